// What a computation may use, and how it learns that it has used it up.
//
// The engine calls check() at a bounded distance in work (every few thousand
// BDD operations); command line, signals and library callers set the limits.

#pragma once

#include "core/error.hpp"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <string>

namespace slugs {

enum class LimitKind { Time, Memory, Interrupt, Nodes };

// Thrown out of the engine; `progress` says in words how far it got.
class LimitReached : public Error {
public:
  LimitReached(LimitKind kind, const std::string &what) : Error(ExitStatus::Limit, what), kind(kind) {}
  LimitKind kind;
};

struct Budget {
  using Clock = std::chrono::steady_clock;
  Clock::time_point deadline = Clock::time_point::max();
  std::size_t memory_bytes = static_cast<std::size_t>(-1); // for the engine's tables
  const std::size_t *also_used = nullptr;         // bytes besides these tables, if someone counts them
  const std::atomic<bool> *interrupted = nullptr; // set from a signal handler

  // Throws LimitReached for time and interrupt.  Memory is checked where it is
  // allocated, before the allocation.
  void check() const {
    if (interrupted && interrupted->load(std::memory_order_relaxed))
      throw LimitReached(LimitKind::Interrupt, "interrupted");
    if (deadline != Clock::time_point::max() && Clock::now() >= deadline)
      throw LimitReached(LimitKind::Time, "time limit reached");
  }
};

// Asks a budget at every so many steps of work that is too small to ask each time.
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
