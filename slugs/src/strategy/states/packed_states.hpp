// Valuations of one copy of the variables, packed into words so that comparing
// words compares valuations lexicographically: variable 0 is the most
// significant bit of the first word.

#pragma once

#include "core/hash.hpp"

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace slugs {

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
  explicit PackedStates(std::size_t words) : words_(words) {}
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

} // namespace slugs
