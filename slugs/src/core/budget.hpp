// Time and memory limits of a computation, and their enforcement.
//
// The engine calls check() after a bounded amount of work (every few thousand
// BDD operations).  Command line and signal handlers set the limits.

#pragma once

#include "core/error.hpp"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <string>

namespace slugs {

enum class LimitKind { Time, Memory, Interrupt, Nodes };

// Thrown by the engine when a limit is reached.
class LimitReached : public Error {
public:
  LimitReached(LimitKind kind, const std::string &what) : Error(ExitStatus::Limit, what), kind(kind) {}
  LimitKind kind;
};

struct Budget {
  using Clock = std::chrono::steady_clock;
  Clock::time_point deadline = Clock::time_point::max();
  std::size_t memory_bytes = static_cast<std::size_t>(-1); // limit of the engine's tables
  const std::atomic<bool> *interrupted = nullptr;          // set by a signal handler

  // Throw LimitReached for time and interrupt.  Memory is checked before each
  // allocation instead.
  void check() const {
    if (interrupted && interrupted->load(std::memory_order_relaxed))
      throw LimitReached(LimitKind::Interrupt, "interrupted");
    if (deadline != Clock::time_point::max() && Clock::now() >= deadline)
      throw LimitReached(LimitKind::Time, "time limit reached");
  }
};

// Checks a budget once per 4096 steps, for steps that are cheaper than a check.
class BudgetPacer {
public:
  explicit BudgetPacer(const Budget &budget) : budget_(budget) {}
  void step() {
    if ((++steps_ & 0xFFF) == 0)
      budget_.check();
  }

private:
  Budget budget_;
  unsigned steps_ = 0;
};

} // namespace slugs
