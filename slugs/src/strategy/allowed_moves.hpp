// The transitions that the strategy may take towards each guarantee.

#pragma once

#include "game/fixpoint.hpp"
#include "game/game.hpp"
#include "strategy/states.hpp"

#include <memory>
#include <vector>

namespace slugs {

class AllowedMoves {
public:
  AllowedMoves(Game &game, const Fixpoint &fixpoint);

  // Prepare transitions(), which works on edges.  Call it once, with collections paused.
  void prepare_cofactors();

  // Return the allowed transitions from a winning state while guarantee j is pursued: for
  // each input that the environment may choose, those of the earliest step of the
  // fixpoint that has any.  The result is a function of next variables, valid until
  // forget().
  Edge transitions(const Word *state, std::size_t j);
  void forget(); // call it with each collection

private:
  // The steps of a guarantee.  bits[b] is digit b of the number of the step that serves
  // a state and an input; targets[n] contains the allowed transitions of step n.
  struct Goal {
    std::vector<Bdd> bits;
    std::vector<Bdd> targets;
  };

  Goal steps_towards(const Bdd &winning, const Bdd &moves, const GoalProgress &progress, std::size_t j);
  Edge collect_steps(const Goal &goal, const Word *state, Edge inputs, std::size_t bits, std::size_t step);

  Game &game_;
  std::vector<Bdd> environment_; // factors of ENV_TRANS in winning states
  std::vector<Goal> goals_;
  std::unique_ptr<StateCofactor> cofactor_;
};

} // namespace slugs
