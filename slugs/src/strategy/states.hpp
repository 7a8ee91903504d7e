// Packed states, their numbers, and cofactors by them.

#pragma once

#include "bdd/bdd.hpp"
#include "core/budget.hpp"
#include "core/hash.hpp"

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

namespace slugs {

// Valuations of one copy of the variables, packed into words so that comparing
// words compares valuations lexicographically: variable 0 is the most
// significant bit of the first word.

using Word = std::uint64_t;

constexpr std::size_t words_for(std::size_t bits) { return bits ? (bits + 63) / 64 : 1; }
constexpr Word word_bit(std::size_t bit) { return Word{1} << (63 - bit % 64); }
inline bool get_bit(const Word *state, std::size_t bit) { return state[bit / 64] & word_bit(bit); }
inline void set_bit(Word *state, std::size_t bit) { state[bit / 64] |= word_bit(bit); }
inline void reset_bit(Word *state, std::size_t bit) { state[bit / 64] &= ~word_bit(bit); }

// Valuations fill words from the most significant bit, and multiplication carries
// upwards only, so the high half is folded into the low one before and after it.
inline Word mix(Word h, Word w) {
  h ^= w;
  h ^= h >> 32;
  h *= second_multiplier;
  return h ^ h >> 32;
}
inline Word hash_words(const Word *words, std::size_t count, Word seed) {
  Word h = seed * golden_multiplier;
  for (std::size_t i = 0; i < count; ++i)
    h = mix(h, words[i]);
  return h;
}

// A list of valuations of the same width.
class PackedStates {
public:
  explicit PackedStates(std::size_t words) : words_(words) { assert(words > 0); }
  std::size_t size() const { return data_.size() / words_; }
  std::size_t bytes() const { return data_.size() * sizeof(Word); }
  void clear() { data_.clear(); }
  void push_back(const Word *state) { data_.insert(data_.end(), state, state + words_); }
  void assign(const Word *states, std::size_t count) { data_.assign(states, states + count * words_); }
  const Word *operator[](std::size_t i) const {
    assert(i < size());
    return data_.data() + i * words_;
  }
  void sort(); // lexicographically

private:
  std::size_t words_;
  std::vector<Word> data_;
};

// Numbering of the nodes (rank, valuation) of an explicit strategy, in the order of
// their insertion.

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
    if (slots_[slot]) {
      assert(slots_[slot] <= count_);
      return slots_[slot] - 1;
    }
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
    assert(slots_[slot] == count_ && find(state, rank, hash) == slot);
    return static_cast<std::uint32_t>(count_ - 1);
  }

  std::size_t size() const { return count_; }
  const Word *state(std::size_t n) const {
    assert(n < count_);
    return &states_[n * words_];
  }
  std::uint32_t rank(std::size_t n) const {
    assert(n < count_);
    return ranks_[n];
  }

private:
  std::size_t find(const Word *state, std::uint32_t rank, Word hash) const {
    assert(count_ < slots_.size()); // the search ends at an empty slot
    for (std::size_t slot = hash & (slots_.size() - 1);; slot = (slot + 1) & (slots_.size() - 1)) {
      const std::uint32_t n = slots_[slot];
      if (!n || (ranks_[n - 1] == rank &&
                 std::memcmp(&states_[(n - 1) * words_], state, words_ * sizeof(Word)) == 0))
        return slot;
    }
  }
  void rehash() {
    const std::size_t size = 2 * slots_.size();
    assert((size & (size - 1)) == 0 && count_ < size);
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

// Cofactors of functions of (current, next) by many current states.
//
// The cofactor of a node depends only on the current variables that occur in its
// diagram, so results are cached by the node and these bits of the state.  Upper nodes
// are visited once per state; no diagram of the state itself is built.

class StateCofactor {
public:
  // `functions` must stay alive and the order of variables unchanged.
  StateCofactor(BddStore &store, const std::vector<Bdd> &functions);

  // Return a function of next variables, valid until the next collection.
  Edge operator()(Edge f, const Word *state);

  void forget(); // call it with each collection

private:
  Edge visit(Edge f, const Word *state);

  struct Slot {
    std::uint32_t node; // 0 in an empty slot
    Edge result;
  };

  static constexpr std::uint32_t next_only = 0xFFFFFFFF;

  Operations &edges_;
  std::size_t words_;
  std::vector<std::uint32_t> mask_of_; // indexed by node: index into masks_, or next_only
  std::vector<Word> masks_;            // sets of current variables
  CountedArray<Slot> slots_;
  CountedArray<Word> keys_; // masked states, indexed by slot
};

// Advancing the rank of a node, the index of the liveness condition that is pursued.
//
// A transition advances the rank past the consecutive conditions that it meets, starting
// with the present one, by at most one full cycle.  These conditions often depend on
// the state alone.  Otherwise they depend on the cofactors of the conditions by the
// state, and equal cofactors advance the rank equally.

class Ranks {
public:
  Ranks(BddStore &store, StateCofactor &cofactor, const std::vector<Bdd> &conditions);

  // The advance on the transitions from a state: the rank of all successors; or, if they
  // differ, the present rank and the number of the tuple of cofactors.
  struct Step {
    std::uint32_t rank;
    std::uint32_t signature; // 0 if all successors have the same rank
  };
  Step from(const Word *state, std::uint32_t rank);
  // Return the rank of a successor; `step` is the last result of from().
  std::uint32_t advance(const Step &step, const Word *next) const;

  void forget() { signatures_.clear(); }

private:
  const Operations &edges_;
  StateCofactor &cofactor_;
  std::vector<Bdd> conditions_;
  std::vector<Edge> cofactors_;
  std::map<std::vector<Edge>, std::uint32_t> signatures_;
};

} // namespace slugs
