// The winning region of a GR(1) game, and the intermediate sets that define a strategy.

#pragma once

#include "bdd/frozen.hpp"
#include "game/game.hpp"
#include "game/reached_goals.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

// One round of the middle fixpoint (Y) for a goal.  The states closer to the goal are
// the union of `waiting` in earlier rounds.  From waiting[i] the system meets the goal,
// moves closer, or stays in waiting[i] while assumption i is not met.  With a bias for
// action, `steps` are computed first: the increasing sets of a least fixpoint without
// assumptions that starts from the states of earlier rounds.  The waiting sets do not
// depend on the states that `steps` add.
struct Round {
  std::vector<FrozenBdd> steps;
  std::vector<FrozenBdd> waiting;
};

using GoalProgress = std::vector<Round>;

// Order in which a round adds states.  The winning region does not depend on it; the
// strategy does.
enum class Steps {
  Plain,         // upstream's order
  BiasForAction, // upstream's order with --biasForAction
  Fewest,        // the fastest order, which does not define a strategy
};

class Fixpoint {
public:
  Fixpoint(Game &game, bool robotics_init, Steps order);

  // Compute the fixpoint, or stop when the system is known to lose initially.  Return
  // whether the system wins.
  bool solve();

  // After solve(): the winning region, or a superset of it if solve() returned false.
  // The system loses from all other states of the restricted game.
  const Bdd &winning() const { return z_; }
  // After solve() returned true: the rounds of each guarantee.
  const std::vector<GoalProgress> &progress() const { return progress_; }
  std::uint64_t outer_iterations() const { return outer_iterations_; } // so far

private:
  class GoalFixpoint;

  Bdd stay(const Bdd &start, const Bdd &moves, const Bdd &allowed);
  void leave_stuck_states();
  void close_under_safety();
  Bdd reach_goal(std::size_t j);
  Bdd wait(const Bdd &open, const Bdd &start, std::size_t i);

  Game &game_;
  bool robotics_init_;
  Steps order_;
  std::vector<bool> decided_by_input_; // per assumption: whether it is independent of next outputs
  Bdd z_;
  std::vector<GoalProgress> progress_; // per guarantee
  std::vector<char> y_converged_;      // per guarantee: whether Y converged in its last round
  ReachedGoals reached_;
  std::uint64_t outer_iterations_ = 0;
};

} // namespace slugs
