// Hash functions, and a small hash table.

#pragma once

#include "core/budget.hpp"

#include <cassert>
#include <cstdint>
#include <vector>

namespace slugs {

// Multipliers of all hash functions.
//
// Multiplication carries upwards only, so a hash function that uses low bits of a
// product must first fold the high bits into them.

// 2^64 divided by the golden ratio: spreads small consecutive numbers (Knuth,
// The Art of Computer Programming, volume 3, section 6.4).
inline constexpr std::uint64_t golden_multiplier = 0x9E3779B97F4A7C15ull;
// Odd and without pattern, for a second step that does not undo the first.
inline constexpr std::uint64_t second_multiplier = 0xD6E8FEB86659FD93ull;

// A minimal hash table from positive numbers, such as edges, to small values, for
// loops in which std::unordered_map would dominate the run time.

template <typename Value> class EdgeTable {
public:
  explicit EdgeTable(MemoryAccount &account) : slots_(account) { slots_.resize(64); }

  // Return the value of the key, or null.  Valid until the next add() or clear().
  const Value *find(std::uint32_t key) const {
    assert(key != 0);
    const Slot &slot = slots_[slot_of(key)];
    return slot.key ? &slot.value : nullptr;
  }

  // The key must be new.
  void add(std::uint32_t key, const Value &value) {
    assert(key != 0 && !find(key));
    if (2 * ++count_ > slots_.size())
      grow();
    slots_[slot_of(key)] = {key, value};
    assert(find(key));
  }

  void clear() {
    slots_.clear_to_zero();
    count_ = 0;
  }

private:
  struct Slot {
    std::uint32_t key; // 0 in an empty slot
    Value value;
  };

  // Return the index of the slot that contains the key, or of the empty slot for it.
  std::size_t slot_of(std::uint32_t key) const {
    assert(2 * count_ <= slots_.size() + 1); // the search ends at an empty slot
    std::size_t place = (key * golden_multiplier >> 32) & (slots_.size() - 1);
    while (slots_[place].key && slots_[place].key != key)
      place = (place + 1) & (slots_.size() - 1);
    return place;
  }

  void grow() {
    assert((slots_.size() & (slots_.size() - 1)) == 0);
    const std::vector<Slot> old(slots_.data(), slots_.data() + slots_.size());
    slots_.resize(2 * slots_.size());
    slots_.clear_to_zero();
    for (const Slot &slot : old)
      if (slot.key)
        slots_[slot_of(slot.key)] = slot;
  }

  CountedArray<Slot> slots_;
  std::size_t count_ = 0;
};

} // namespace slugs
