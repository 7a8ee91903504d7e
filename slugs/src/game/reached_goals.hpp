// Goals that can be reached from every winning state, as stepping stones to others.
//
// Suppose that from all of Z the system reaches goal 1, which meets it at last by
// answering some of the environment's moves, A.  If it can answer each move of A
// so that goal 2 is met immediately or from where that leads, then it reaches goal 2
// from all of Z, too: as the least fixpoint of goal 1 grows from the answers to A,
// that of goal 2 grows from answers to as many.  So the fixpoint of a goal may
// stop at Z as soon as it covers the last moves of some other.  Between neighbours
// this takes a few steps, where going through all of Z takes hundreds.
//
// Only for the verdict: a strategy needs the way to each goal.

#pragma once

#include "bdd/frozen.hpp"
#include "game/game.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

class ReachedGoals {
public:
  explicit ReachedGoals(Game &game) : store_(game.store), begun_(game.store.work()) {}

  // From all of Z a goal is reached by answers to the moves `last` that meet it.
  void add(const Bdd &last);
  // Z has changed: nothing is known about it.
  void clear() { goals_.clear(); }
  // Whether no last move of some goal is among `open`.  If that would take much
  // longer to find out than it can save, false.
  bool covered(const Bdd &open);

private:
  struct Goal {
    FrozenBdd last;
    std::vector<bool> uncovered; // a last move, perhaps uncovered: tried first, because that is cheap
  };

  BddStore &store_;
  std::uint64_t begun_;     // work of the store
  std::uint64_t spent_ = 0; // work here
  std::vector<Goal> goals_;
};

} // namespace slugs
