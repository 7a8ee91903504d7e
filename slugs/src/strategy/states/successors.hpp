// From a function of next variables to the list of valuations that it stands
// for, in lexicographic order.

#pragma once

#include "bdd/edge_table.hpp"
#include "core/counted_array.hpp"
#include "game/game.hpp"
#include "strategy/states/packed_states.hpp"

#include <vector>

namespace slugs {

class Successors {
public:
  enum class Answers {
    Least, // for each next input that f allows, with the lexicographically least output
    All,   // everything that f allows
  };
  Successors(Game &game, Answers answers);

  // Sorted; valid until the next call.  What is remembered of diagrams does not
  // survive a collection: whoever uses this pauses them, and forgets with each.
  const PackedStates &of(Edge f);
  void forget();

private:
  struct List { // of valuations in lists_, sorted by those bits that tell them apart
    std::size_t start, count;
  };

  List list_below(Edge f, std::size_t k);
  List list_at(Edge f, std::size_t k);
  List join(List low, List high, std::uint32_t bit);
  template <std::size_t Words>
  std::size_t merge(const Word *low, std::size_t lows, const Word *high, std::size_t highs, std::uint32_t bit,
                    Word *result) const;
  std::size_t reserve(std::size_t count);

  Game &game_;
  std::size_t words_;
  std::vector<Var> by_level_;              // next variables
  std::vector<std::size_t> place_;         // of a variable in by_level_
  std::vector<std::uint32_t> told_before_; // how many bits of the mask by_level_[..k) have
  std::vector<Word> mask_;                 // the bits that tell valuations of a list apart
  bool sorted_ = true;                     // sorted by the mask is sorted
  CountedArray<Word> lists_;
  std::size_t used_ = 1; // valuations; the first one is all 0
  EdgeTable<List> list_of_;
  PackedStates found_;
};

} // namespace slugs
