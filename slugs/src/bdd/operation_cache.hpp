// The operation cache, one for all operations: direct-mapped, so a new result
// replaces an old one.  It grows with the unique table.

#pragma once

#include "bdd/edge.hpp"
#include "core/counted_array.hpp"
#include "core/hash.hpp"

#include <cassert>
#include <cstddef>
#include <cstdint>

namespace slugs {

enum class Operation : std::uint32_t {
  Simplify, // value 0 is safe: its first operand is never constant, so no key is 0
  And,
  Xor,
  Ite,
  Exists,
  AndExists,
  MinusAndExists,
  Shift,
  count
};

class OperationCache {
public:
  explicit OperationCache(MemoryAccount &account);

  // Look up a result and return whether it is cached.
  bool find(Operation op, Edge f, std::uint32_t g, std::uint32_t h, Edge &result) const {
    const std::uint32_t key = key_of(op, f);
    const Entry &entry = entries_[slot_of(key, g, h)];
    if (entry.f_and_operation != key || entry.g != g || entry.h != h)
      return false;
    result = entry.result;
    return true;
  }
  void add(Operation op, Edge f, std::uint32_t g, std::uint32_t h, Edge result) {
    const std::uint32_t key = key_of(op, f);
    entries_[slot_of(key, g, h)] = {key, g, h, result};
  }

  void clear() { entries_.clear_to_zero(); }
  // Remove results that refer to dead edges.
  template <typename Dead> void forget(const Dead &dead) {
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      Entry &entry = entries_[i];
      if (!entry.f_and_operation)
        continue;
      const auto op = static_cast<Operation>(entry.f_and_operation >> operation_shift);
      const Edge f = entry.f_and_operation & ((1u << operation_shift) - 1);
      if (dead(f) || dead(entry.result) || (second_is_edge(op) && dead(entry.g)) ||
          (third_is_edge(op) && dead(entry.h)))
        entry = {};
    }
  }
  // Grow to the size suited to this many nodes, if memory allows.
  void fit(std::size_t nodes);

private:
  struct Entry {
    std::uint32_t f_and_operation; // 0 in an empty entry
    std::uint32_t g;
    std::uint32_t h;
    Edge result;
  };
  static constexpr unsigned operation_shift = 29;
  static_assert(static_cast<std::uint32_t>(Operation::count) <= 1u << (32 - operation_shift),
                "the cache key has no bit left for another operation");

  // Other operands are numbers: a set of variables, or the direction of Shift, 0 or 1,
  // which are live as edges.
  static bool second_is_edge(Operation op) { return op != Operation::Exists; }
  static bool third_is_edge(Operation op) { return op == Operation::Ite || op == Operation::MinusAndExists; }
  static std::uint32_t key_of(Operation op, Edge f) {
    assert(f > bdd_true && f >> operation_shift == 0);
    return f | static_cast<std::uint32_t>(op) << operation_shift;
  }
  std::size_t slot_of(std::uint32_t key, std::uint32_t g, std::uint32_t h) const {
    std::uint64_t x = (std::uint64_t{key} << 32 | g) * golden_multiplier;
    x ^= x >> 32;
    x = (x + h) * second_multiplier;
    return static_cast<std::size_t>(x >> 32) & (entries_.size() - 1);
  }

  MemoryAccount &account_;
  CountedArray<Entry> entries_;
};

} // namespace slugs
