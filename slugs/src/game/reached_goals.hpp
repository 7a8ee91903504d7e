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

#pragma once

#include "bdd/frozen.hpp"
#include "game/game.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

class ReachedGoals {
public:
  explicit ReachedGoals(Game &game) : store_(game.store), work_at_start_(game.store.work()) {}

  // Add a goal that is reached from all of Z and met by answering the moves `last`.
  void add(const Bdd &last);
  // Remove all goals, after Z has changed.
  void clear() { goals_.clear(); }
  // Return whether none of the last moves of some goal is in `open`; also false if
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

} // namespace slugs
