// Limits of a run, the errors that end it, and arrays that are charged to its memory limit.

#pragma once

#include "core/tuning.hpp"

#include <atomic>
#include <cassert>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace slugs {

// Exit statuses of the command.

enum class ExitStatus {
  Realizable = 0, // also: translation done
  BadInput = 2,   // invalid input or usage
  Limit = 3,      // time limit, memory limit or interrupt
  Internal = 4,   // bug, or output that could not be written
  Unrealizable = 10
};

// Errors that end a run, each with its exit status.

class Error : public std::runtime_error {
public:
  Error(ExitStatus status, const std::string &what) : std::runtime_error(what), status(status) {
    assert(status != ExitStatus::Realizable && status != ExitStatus::Unrealizable);
  }
  // Return the text that the command prints: complete lines.
  virtual std::string message() const { return std::string("slugs: ") + what() + '\n'; }

  ExitStatus status;
};

// Failure of a file, a pipe or a disk.
struct InputOutputError : Error {
  using Error::Error;
};

// Time and memory limits of a computation, and their enforcement.
//
// The engine calls check() after a bounded amount of work (every few thousand
// BDD operations).  Command line and signal handlers set the limits.

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
  Tuning tuning;

  // Throw LimitReached for time and interrupt.  Memory is checked before each
  // allocation instead.
  void check() const {
    if (interrupted && interrupted->load(std::memory_order_relaxed))
      throw LimitReached(LimitKind::Interrupt, "interrupted");
    if (deadline != Clock::time_point::max() && Clock::now() >= deadline)
      throw LimitReached(LimitKind::Time, "time limit reached");
  }
};

// Check of a budget once per 4096 steps, for steps that are cheaper than a check.
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

// Arrays that charge their bytes to the budget before they allocate them.
//
// The large tables of the engine use them.  Growth uses realloc, so that the
// operating system can remap pages instead of copying them.  A failed allocation
// and an exceeded budget both throw LimitReached.

class MemoryAccount {
public:
  explicit MemoryAccount(const Budget &budget) : budget_(budget) { assert(budget.tuning.in_range()); }

  bool has_room(std::size_t bytes) const {
    return bytes <= budget_.memory_bytes && used_ <= budget_.memory_bytes - bytes;
  }
  // Charge bytes before they are allocated; release() returns them.
  void take(std::size_t bytes) {
    if (!has_room(bytes))
      refuse();
    used_ += bytes;
    assert(used_ >= bytes && used_ <= budget_.memory_bytes);
    if (used_ > peak_)
      peak_ = used_;
  }
  void release(std::size_t bytes) {
    assert(bytes <= used_);
    used_ -= bytes;
  }
  [[noreturn]] static void refuse() { throw LimitReached(LimitKind::Memory, "memory limit reached"); }

  std::size_t used() const { return used_; }
  std::size_t peak() const {
    assert(peak_ >= used_);
    return peak_;
  }
  const Budget &budget() const { return budget_; }

private:
  Budget budget_;
  std::size_t used_ = 0;
  std::size_t peak_ = 0;
};

template <typename T> class CountedArray {
  static_assert(std::is_trivially_copyable_v<T>);

public:
  explicit CountedArray(MemoryAccount &account) : account_(account) {}
  ~CountedArray() { release(); }
  CountedArray(CountedArray &&other) noexcept
      : account_(other.account_), data_(other.data_), size_(other.size_) {
    other.data_ = nullptr;
    other.size_ = 0;
  }
  CountedArray(const CountedArray &) = delete;
  CountedArray &operator=(const CountedArray &) = delete;

  // Change the size; keep the common prefix and set new entries to zero.
  void resize(std::size_t size) {
    const std::size_t old_bytes = size_ * sizeof(T), bytes = size * sizeof(T);
    assert(bytes / sizeof(T) == size); // no overflow
    assert((data_ == nullptr) == (size_ == 0));
    if (size == 0)
      return release();
    if (bytes > old_bytes)
      account_.take(bytes - old_bytes);
    void *moved = std::realloc(static_cast<void *>(data_), bytes);
    if (!moved) {
      if (bytes > old_bytes)
        account_.release(bytes - old_bytes);
      MemoryAccount::refuse();
    }
    data_ = static_cast<T *>(moved);
    if (bytes > old_bytes)
      std::memset(static_cast<void *>(data_ + size_), 0, bytes - old_bytes);
    else
      account_.release(old_bytes - bytes);
    size_ = size;
    assert(account_.used() >= bytes);
  }
  void release() {
    std::free(static_cast<void *>(data_));
    account_.release(size_ * sizeof(T));
    data_ = nullptr;
    size_ = 0;
  }
  void clear_to_zero() {
    assert(data_ || size_ == 0);
    if (size_)
      std::memset(static_cast<void *>(data_), 0, size_ * sizeof(T));
  }

  T &operator[](std::size_t i) {
    assert(i < size_);
    return data_[i];
  }
  const T &operator[](std::size_t i) const {
    assert(i < size_);
    return data_[i];
  }
  std::size_t size() const { return size_; }
  T *data() { return data_; }

private:
  MemoryAccount &account_;
  T *data_ = nullptr;
  std::size_t size_ = 0;
};

} // namespace slugs
