// For each guarantee, which transitions the strategy may take towards it.

#pragma once

#include "game/fixpoint.hpp"
#include "game/game.hpp"
#include "strategy/states/state_cofactor.hpp"

#include <memory>
#include <vector>

namespace slugs {

class AllowedMoves {
public:
  AllowedMoves(Game &game, const Fixpoint &fixpoint);

  // Must be called once before transitions(), when the store no longer
  // collects: what follows works on edges.
  void prepare_cofactors();

  // From a winning state, for the inputs that the environment may choose, what
  // the strategy may do while it pursues guarantee j: for each input, the
  // transitions of the earliest step of the fixpoint that has any.  A function
  // of next variables, which lives until forget().
  Edge transitions(const Word *state, std::size_t j) { return transitions(state, j, bdd_true); }
  // The same for `inputs` only, a function of next inputs.
  Edge transitions(const Word *state, std::size_t j, Edge inputs);
  void forget(); // with a collection

private:
  // For a guarantee: which step serves a state and an input, as a binary number
  // of which bits[b] is one digit, and where each step may lead.
  struct Goal {
    std::vector<Bdd> bits;
    std::vector<Bdd> targets;
  };

  Goal steps_towards(const Bdd &winning, const Bdd &moves, const GoalProgress &progress, std::size_t j);
  Edge collect_steps(const Goal &goal, const Word *state, Edge inputs, std::size_t bits, std::size_t step);

  Game &game_;
  std::vector<Bdd> environment_; // in winning states their conjunction is what it may do
  std::vector<Goal> goals_;
  std::unique_ptr<StateCofactor> cofactor_;
};

} // namespace slugs
