// Cofactors of functions of (current, next) by many current states.
//
// The cofactor of a node depends only on the current variables that occur in its
// diagram, so results are cached by the node and these bits of the state.  Upper nodes
// are visited once per state; no diagram of the state itself is built.

#pragma once

#include "bdd/bdd.hpp"
#include "strategy/states/packed_states.hpp"

#include <vector>

namespace slugs {

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

} // namespace slugs
