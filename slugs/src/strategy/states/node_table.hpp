// Numbering of the nodes (rank, valuation) of an explicit strategy, in the order of
// their insertion.

#pragma once

#include "core/counted_array.hpp"
#include "strategy/states/packed_states.hpp"

namespace slugs {

class NodeTable {
public:
  NodeTable(std::size_t words, MemoryAccount &account)
      : words_(words), states_(account), ranks_(account), slots_(account) {
    slots_.resize(1 << 10);
  }

  // Return the number of the node, and add it if it is new.
  std::uint32_t intern(const Word *state, std::uint32_t rank) {
    const Word hash = hash_words(state, words_, rank + 1);
    std::size_t slot = find(state, rank, hash);
    if (slots_[slot])
      return slots_[slot] - 1;
    if (2 * (count_ + 1) > slots_.size()) {
      rehash();
      slot = find(state, rank, hash);
    }
    if (count_ == ranks_.size()) {
      const std::size_t size = count_ < 1024 ? 1024 : count_ + count_ / 2;
      states_.resize(size * words_);
      ranks_.resize(size);
    }
    for (std::size_t w = 0; w < words_; ++w)
      states_[count_ * words_ + w] = state[w];
    ranks_[count_] = rank;
    slots_[slot] = static_cast<std::uint32_t>(++count_);
    return static_cast<std::uint32_t>(count_ - 1);
  }

  std::size_t size() const { return count_; }
  const Word *state(std::size_t n) const { return &states_[n * words_]; }
  std::uint32_t rank(std::size_t n) const { return ranks_[n]; }

private:
  std::size_t find(const Word *state, std::uint32_t rank, Word hash) const {
    for (std::size_t slot = hash & (slots_.size() - 1);; slot = (slot + 1) & (slots_.size() - 1)) {
      const std::uint32_t n = slots_[slot];
      if (!n || (ranks_[n - 1] == rank &&
                 std::memcmp(&states_[(n - 1) * words_], state, words_ * sizeof(Word)) == 0))
        return slot;
    }
  }
  void rehash() {
    const std::size_t size = 2 * slots_.size();
    slots_.release();
    slots_.resize(size);
    for (std::size_t n = 0; n < count_; ++n) {
      std::size_t slot = hash_words(state(n), words_, ranks_[n] + 1) & (size - 1);
      while (slots_[slot])
        slot = (slot + 1) & (size - 1);
      slots_[slot] = static_cast<std::uint32_t>(n + 1);
    }
  }

  std::size_t words_;
  std::size_t count_ = 0;
  CountedArray<Word> states_;
  CountedArray<std::uint32_t> ranks_;
  CountedArray<std::uint32_t> slots_; // number + 1; 0 in an empty slot
};

} // namespace slugs
