// The handler, see command/signals.hpp.  Its state is process-wide, as signals
// are.

#include "command/signals.hpp"

#include <signal.h>

namespace slugs {

namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may not lock");

extern "C" void note_interrupt(int) { interrupted.store(true, std::memory_order_relaxed); }

} // namespace

const std::atomic<bool> &catch_signals() {
  // No SA_RESTART: a read or write that blocks must end as well.
  struct sigaction action = {};
  action.sa_handler = note_interrupt;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGHUP, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
  return interrupted;
}

} // namespace slugs
