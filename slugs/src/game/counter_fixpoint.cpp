// The dual of the fixpoint in game/fixpoint.cpp (compare Könighofer, Hofferek and
// Bloem, STTT 2013, for conditions on states), over transitions:
//
//   mu W. \/_j nu Y. /\_i mu X. force( W' | (!G_j & Y' & (A_i | X')) )
//
// where force(T) is the set of states in which the environment has a next input such
// that every transition of the system is in T.  G_j and A_i must be evaluated on
// the transition taken, not on the state: an environment wins only if its transitions
// satisfy A_i.
//
// W grows in stages, and each stage prevents one goal j.  A play never returns to a
// later stage, so it eventually stays in one stage, where goal j is never met again.
// Within a stage the layers of X lead to a transition that meets assumption i, after
// which the next assumption is pursued.  Hence i is the only memory of a strategy.
// Attractor stages, which only force the play into W, come first, because they are
// cheap.

#include "game/counter_fixpoint.hpp"

namespace slugs {

CounterFixpoint::CounterFixpoint(Game &game, const Bdd &losing, bool robotics_init)
    : game_(game), losing_(losing), robotics_init_(robotics_init), won_(game.store.constant(false)),
      moves_(game.assumptions.size(), game.store.constant(false)) {
  bool progress = true;
  attract();
  while (progress && !decided()) {
    progress = false;
    for (std::size_t j = 0; j < game_.guarantees.size() && !decided(); ++j)
      if (prevent(j)) {
        attract();
        progress = true;
      }
  }
}

bool CounterFixpoint::decided() { return !game_.wins_initially(!won_, robotics_init_); }

Bdd CounterFixpoint::initial() {
  const Bdd lost = game_.env_init & game_.sys_init & won_;
  if (robotics_init_)
    return lost;
  const Bdd all_lost = game_.env_init & !game_.store.and_exists(game_.sys_init, !won_, game_.current_outputs);
  return lost & all_lost;
}

Bdd CounterFixpoint::forcing(const Bdd &targets) {
  const Bdd stuck = game_.env_trans & !game_.answerable;
  return stuck | game_.store.minus_and_exists(game_.env_trans, game_.sys_trans, !targets, game_.next_outputs);
}

void CounterFixpoint::attract() {
  for (;;) {
    const Bdd moves = forcing(game_.store.to_next(won_));
    const Bdd fresh = losing_ & !won_ & game_.store.exists(moves, game_.next_inputs);
    if (fresh.is_false())
      return;
    for (Bdd &all : moves_)
      all |= moves & fresh;
    won_ |= fresh;
  }
}

// Add a stage: the states from which the environment can prevent goal j forever
// while it meets all assumptions infinitely often, or force the play into earlier
// stages.  Return whether there are any.
bool CounterFixpoint::prevent(std::size_t j) {
  BddStore &store = game_.store;
  const Bdd won_next = store.to_next(won_);
  Bdd y = losing_ & !won_;
  std::vector<Bdd> stage(moves_.size(), store.constant(false));
  for (;;) {
    const Bdd before = y;
    const Bdd avoid = store.to_next(y) & !game_.guarantees[j];
    for (std::size_t i = 0; i < stage.size(); ++i) {
      stage[i] = store.constant(false);
      Bdd x = store.constant(false);
      for (;;) {
        const Bdd closer = game_.assumptions[i] | store.to_next(x);
        const Bdd moves = forcing(won_next | (avoid & closer));
        const Bdd fresh = y & !x & store.exists(moves, game_.next_inputs);
        if (fresh.is_false())
          break;
        stage[i] |= moves & fresh;
        x |= fresh;
      }
      y = x;
      if (y.is_false())
        return false;
    }
    if (y == before)
      break;
  }
  won_ |= y;
  for (std::size_t i = 0; i < stage.size(); ++i)
    moves_[i] |= stage[i];
  return true;
}

} // namespace slugs
