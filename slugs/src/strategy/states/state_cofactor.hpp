// Functions of (current, next) cofactored by a current state, many times over.
//
// What a node becomes depends only on those current variables that occur below
// it, so results are remembered for the node and these bits of the state, and
// later states that share them stop there.  Upper nodes are visited once a
// state; no diagram is ever made for the state itself.

#pragma once

#include "bdd/bdd.hpp"
#include "strategy/states/packed_states.hpp"

#include <vector>

namespace slugs {

class StateCofactor {
public:
  // `functions` must stay alive and the order of variables unchanged.
  StateCofactor(BddStore &store, const std::vector<Bdd> &functions);

  // A function of next variables only; lives until the next collection.
  Edge operator()(Edge f, const Word *state);

  void forget(); // before or after a collection

private:
  Edge visit(Edge f, const Word *state);

  struct Slot {
    std::uint32_t node; // 0 in an empty slot
    Edge result;
  };

  static constexpr std::uint32_t next_only = 0xFFFFFFFF;

  Operations &edges_;
  std::size_t words_;
  std::vector<std::uint32_t> mask_of_; // by node: index into masks_, or next_only
  std::vector<Word> masks_;
  CountedArray<Slot> slots_;
  CountedArray<Word> keys_; // by slot: the bits of the state
};

} // namespace slugs
