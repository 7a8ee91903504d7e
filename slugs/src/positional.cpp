// The steps in the order that fixes the strategy: round after round, within a
// round first the plain steps (bias for action), then assumption after
// assumption.  A step offers
//
//   SYS_TRANS & ( (G_j & Z') | closer' | (!A_i & waiting_i') )
//
// and serves those pairs of state and input that no earlier step has served.
// What `closer` had before and what `waiting_i` had a round ago has been served,
// so only what is new in them is looked at.

#include "positional.hpp"

#include <vector>

namespace slugs {

namespace {

class FirstServed {
public:
  FirstServed(Game &game, const Bdd &winning, std::size_t j)
      : game_(game), chosen_(game.store.constant(false)), open_(game.env_trans & winning),
        targets_(game.guarantees[j] & game.store.to_next(winning)), closer_(game.store.constant(false)),
        waited_(game.assumptions.size(), game.store.constant(false)) {}

  bool done() const { return open_.is_false(); }
  const Bdd &chosen() const { return chosen_; }

  void come_closer(const Bdd &closer) {
    targets_ |= game_.store.to_next(closer & !closer_);
    closer_ = closer;
  }
  void wait(std::size_t i, const Bdd &waiting) {
    targets_ |= (!game_.assumptions[i]) & game_.store.to_next(waiting & !waited_[i]);
    waited_[i] = waiting;
  }
  void take() {
    if (targets_.is_false())
      return;
    const Bdd served = open_ & game_.store.exists_both(game_.sys_trans, targets_, game_.next_outputs);
    chosen_ |= game_.sys_trans & targets_ & served;
    open_ &= !served;
    targets_ = game_.store.constant(false);
  }

private:
  Game &game_;
  Bdd chosen_;
  Bdd open_;
  Bdd targets_;
  Bdd closer_;
  std::vector<Bdd> waited_;
};

} // namespace

Bdd positional_strategy(Game &game, const Bdd &winning, const GoalProgress &progress, std::size_t j) {
  BddStore &store = game.store;
  FirstServed steps(game, winning, j);
  Bdd closer = store.constant(false);
  for (const Round &round : progress) {
    for (const FrozenBdd &step : round.steps) {
      closer = step.thaw(store);
      steps.come_closer(closer);
      steps.take();
    }
    steps.come_closer(closer);
    for (std::size_t i = 0; i < round.waiting.size() && !steps.done(); ++i) {
      const Bdd waiting = round.waiting[i].thaw(store);
      steps.wait(i, waiting);
      steps.take();
      closer |= waiting;
    }
    if (steps.done())
      break;
  }
  return steps.chosen();
}

} // namespace slugs
