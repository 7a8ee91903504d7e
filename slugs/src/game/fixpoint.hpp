// The fixpoints of both players.

#pragma once

#include "bdd/bdd.hpp"
#include "game/game.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

// Goals that the system can reach from all of Z, used to shorten the fixpoints of others.
//
// Suppose that the system reaches goal 1 from all of Z, and that its last step towards
// goal 1 answers one of the environment's moves A.  If it can answer each move of A such
// that goal 2 is met, immediately or from the successor, then it also reaches goal 2
// from all of Z: the least fixpoint of goal 1 grows from the answers to A, and that of
// goal 2 from answers to at least these moves.  So the fixpoint of a goal may stop
// with the result Z as soon as it covers the last moves of another goal.  For goals near
// each other this takes a few steps, where covering all of Z takes hundreds.
//
// This applies only to the verdict: a strategy needs the rounds of each goal.

class ReachedGoals {
public:
  explicit ReachedGoals(Game &game) : store_(game.store), work_at_start_(game.store.work()) {}

  // Add a goal that is reached from all of Z and met by answering the moves `last`.
  void add(const Bdd &last);
  // Remove all goals, after Z has changed.
  void clear() { goals_.clear(); }
  // Return whether some goal has no last move in `open`; also false if
  // checking takes a larger share of the work than it can save.
  bool covered(const Bdd &open);

private:
  struct Goal {
    FrozenBdd last;
    std::vector<bool> uncovered; // last move found uncovered before; cheap to check first
  };

  BddStore &store_;
  std::uint64_t work_at_start_;  // work of the store at construction
  std::uint64_t check_work_ = 0; // work of covered()
  std::vector<Goal> goals_;
};

// The winning region of a GR(1) game, and the intermediate sets that define a strategy.

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

// The winning moves of the environment from the states that the system loses.

class CounterFixpoint {
public:
  // `losing`: states from which the system loses: all of them, or enough for the
  // environment to win initially.
  CounterFixpoint(Game &game, const Bdd &losing, bool robotics_init);

  // Per assumption: the moves (state, next inputs) that keep the environment winning
  // and lead it towards meeting the assumption.
  const std::vector<Bdd> &moves() const { return moves_; }
  // Return the initial states that decide the game: those whose inputs lose with every
  // output, or with robotics_init all losing ones; none only if SYS_INIT allows none.
  Bdd initial();

private:
  Bdd forcing(const Bdd &targets); // moves (state, next inputs) that force a target
  void attract();
  bool prevent(std::size_t j);
  bool decided();

  Game &game_;
  Bdd losing_;
  bool robotics_init_;
  Bdd won_;
  std::vector<Bdd> moves_;
};

} // namespace slugs
