// From a function of next variables to the list of valuations that it stands
// for, in lexicographic order.

#pragma once

#include "game.hpp"
#include "packed_states.hpp"

#include <array>
#include <vector>

namespace slugs {

class Successors {
public:
  explicit Successors(Game &game);

  // Sorted lists; valid until the next call.
  // For each next input that f allows, with the lexicographically least output.
  const PackedStates &least(Edge f);
  // Everything that f allows.
  const PackedStates &all(Edge f);

  // The least next output is chosen by diagrams: f & "no smaller one in f".
  Edge least_outputs(Edge f);

private:
  bool enumerate(Edge f);
  template <std::size_t Words> bool follow(Edge f, std::size_t k, std::array<Word, Words> valuation);
  bool follow_wide(Edge f, std::size_t k);
  bool keep(const Word *valuation);
  void check_limits() const;

  Game &game_;
  std::vector<Var> by_level_;          // next variables
  std::vector<char> is_input_;         // by bit
  std::vector<std::uint32_t> outputs_; // bits, as declared
  std::vector<VarSet> outputs_from_;   // the next copies of outputs_[k] and later ones
  std::vector<Word> input_mask_;
  std::vector<Word> valuation_; // of follow_wide
  PackedStates found_;
  std::size_t limit_ = 0;
  bool all_outputs_ = false;
};

} // namespace slugs
