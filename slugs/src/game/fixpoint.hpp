// The winning states of a GR(1) game, and what is needed to win from them.

#pragma once

#include "bdd/frozen.hpp"
#include "core/statistics.hpp"
#include "game/game.hpp"
#include "game/reached_goals.hpp"

#include <vector>

namespace slugs {

// One round of the middle fixpoint (Y) for a goal.  The states to come closer to
// are all of waiting in earlier rounds.  From waiting[i] the system reaches the
// goal, or comes closer, or stays in waiting[i] while assumption i fails.  With a
// bias for action there are first `steps`, the ever larger sets of states that a
// least fixpoint without assumptions comes closer to, from those of earlier
// rounds on; waiting relies on none of what they add.
struct Round {
  std::vector<FrozenBdd> steps;
  std::vector<FrozenBdd> waiting;
};

using GoalProgress = std::vector<Round>;

// In which order the states to come closer to are found.  The winning states do
// not depend on it, the strategy does.
enum class Steps {
  Plain,         // upstream's order
  BiasForAction, // upstream's order with --biasForAction
  Fewest,        // the fastest to compute; no strategy can be made of it
};

class Fixpoint {
public:
  Fixpoint(Game &game, bool robotics_init, Steps order, Statistics &statistics);

  // Computes until done, or until some initial position is known to be lost.
  // Returns whether the system wins.
  bool solve();

  // After solve(): the winning states, or if it returned false a superset of
  // them; the system loses from all other states that the game is restricted to.
  const Bdd &winning() const { return z_; }
  // After solve() returned true: for each guarantee the way to it.
  const std::vector<GoalProgress> &progress() const { return progress_; }

private:
  Bdd stay(const Bdd &start, const Bdd &moves, const Bdd &allowed, std::uint64_t &iterations);
  void leave_stuck_states();
  void close_under_safety();
  Bdd reach_goal(std::size_t j);
  Bdd wait(const Bdd &open, const Bdd &start, std::size_t i, std::uint64_t &iterations);

  Game &game_;
  bool robotics_init_;
  Steps order_;
  Statistics &statistics_;
  std::vector<bool> decided_by_input_; // by assumption: it does not depend on next outputs
  Bdd z_;
  std::vector<GoalProgress> progress_; // by guarantee
  std::vector<char> settled_;          // by guarantee: did Y stop growing in its last round?
  ReachedGoals reached_;
};

} // namespace slugs
