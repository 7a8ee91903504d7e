// Enumeration of the valuations of a function of next variables in lexicographic order.

#pragma once

#include "core/budget.hpp"
#include "core/hash.hpp"
#include "game/game.hpp"
#include "strategy/states.hpp"

#include <vector>

namespace slugs {

class Successors {
public:
  enum class Answers {
    Least, // each next input that f allows, with the lexicographically least output
    All,   // all valuations that f allows
  };
  Successors(Game &game, Answers answers);

  // Return the sorted valuations, valid until the next call.  Collections must be paused.
  const PackedStates &of(Edge f);
  void forget(); // call it at each collection

private:
  struct List { // range of valuations in lists_, sorted by their masked bits
    std::size_t start, count;
  };

  bool ascends(const PackedStates &states) const; // for assertions
  List list_below(Edge f, std::size_t k);
  List list_at(Edge f, std::size_t k);
  List join(List low, List high, std::uint32_t bit);
  template <std::size_t Words>
  std::size_t merge(const Word *low, std::size_t lows, const Word *high, std::size_t highs, std::uint32_t bit,
                    Word *result) const;
  std::size_t reserve(std::size_t count);

  Game &game_;
  std::size_t words_;
  std::vector<Var> by_level_;                   // next variables
  std::vector<std::size_t> place_;              // indices into by_level_, by variable
  std::vector<std::uint32_t> mask_bits_before_; // number of mask bits in by_level_[..k)
  std::vector<Word> mask_;                      // bits that distinguish the valuations of a list
  bool sorted_ = true;                          // whether lists sorted by the mask are sorted
  CountedArray<Word> lists_;
  std::size_t used_ = 1; // number of valuations in lists_; the first one is all 0
  EdgeTable<List> list_of_;
  PackedStates found_;
};

} // namespace slugs
