// A hash table from edges, or other numbers above 0, to small values: with
// nothing but what that takes, for where a general one would be most of the work.

#pragma once

#include "core/counted_array.hpp"
#include "core/hash.hpp"

#include <cassert>
#include <cstdint>
#include <vector>

namespace slugs {

template <typename Value> class EdgeTable {
public:
  explicit EdgeTable(MemoryAccount &account) : slots_(account) { slots_.resize(64); }

  // Valid until the next add() or clear(); null if there is none.
  const Value *find(std::uint32_t key) const {
    const Slot &slot = slots_[place_of(key)];
    return slot.key ? &slot.value : nullptr;
  }

  // The key must be new.
  void add(std::uint32_t key, const Value &value) {
    assert(key != 0 && !find(key));
    if (2 * ++count_ > slots_.size())
      grow();
    slots_[place_of(key)] = {key, value};
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

  // Where the key is, or would be.
  std::size_t place_of(std::uint32_t key) const {
    std::size_t place = (key * golden_multiplier >> 32) & (slots_.size() - 1);
    while (slots_[place].key && slots_[place].key != key)
      place = (place + 1) & (slots_.size() - 1);
    return place;
  }

  void grow() {
    const std::vector<Slot> old(slots_.data(), slots_.data() + slots_.size());
    slots_.resize(2 * slots_.size());
    slots_.clear_to_zero();
    for (const Slot &slot : old)
      if (slot.key)
        slots_[place_of(slot.key)] = slot;
  }

  CountedArray<Slot> slots_;
  std::size_t count_ = 0;
};

} // namespace slugs
