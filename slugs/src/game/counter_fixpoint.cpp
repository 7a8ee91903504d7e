// The dual of the fixpoint in game/fixpoint.cpp (compare Könighofer, Hofferek and
// Bloem, STTT 2013, for conditions on states), over transitions:
//
//   mu W. \/_j nu Y. /\_i mu X. force( W' | (!G_j & Y' & (A_i | X')) )
//
// where force(T) are the states in which the environment has a next input such
// that every transition the system can answer with is in T.  G_j and A_i must
// be read on the transition that was taken, not on the state: an environment
// that satisfies A_i by where it is, but not by how it moves, does not win.
//
// W grows in stages, and each stage has one goal j that it prevents.  A play
// never goes back to a later stage, so it stays in some stage forever; there
// goal j is never reached again.  Within a stage the layers of X lead to a
// transition that satisfies assumption i, after which the next assumption is
// pursued.  Hence a strategy needs no memory but i.  Stages that merely force
// the play into W (attract) come first, because they are cheap.

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
  const Bdd all_lost =
      game_.env_init & !game_.store.exists_both(game_.sys_init, !won_, game_.current_outputs);
  return lost & all_lost;
}

Bdd CounterFixpoint::forcing(const Bdd &targets) {
  const Bdd stuck = game_.env_trans & !game_.answerable;
  return stuck |
         game_.store.minus_exists_both(game_.env_trans, game_.sys_trans, !targets, game_.next_outputs);
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

// One stage: the states from which the environment can prevent goal j forever
// while it satisfies all assumptions infinitely often, or force the play into
// earlier stages.  Returns whether there are any.
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
