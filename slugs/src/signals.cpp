// The handler, see signals.hpp.  Process-wide by nature: signals are.

#include "signals.hpp"

#include <csignal>

namespace slugs {

namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may not lock");

extern "C" void note_interrupt(int) { interrupted.store(true, std::memory_order_relaxed); }

} // namespace

const std::atomic<bool> &catch_signals() {
  std::signal(SIGINT, note_interrupt);
  std::signal(SIGTERM, note_interrupt);
  std::signal(SIGPIPE, SIG_IGN);
  return interrupted;
}

} // namespace slugs
