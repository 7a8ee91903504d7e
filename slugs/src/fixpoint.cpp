// The three nested fixpoints of Bloem, Jobstmann, Piterman, Pnueli and Sa'ar
// (JCSS 2012), with liveness conditions over transitions as in Ehlers and Raman
// (CAV 2016):
//
//   nu Z. /\_j mu Y. \/_i nu X. cpre( (G_j & Z') | Y' | (!A_i & X') )
//
// - Z starts as the greatest fixpoint of cpre(Z'), which is cheap and contains
//   the result, and is closed again whenever a goal shrinks it.
// - Goals update Z one after the other.  A goal that was computed with a larger
//   Z may lead out of the present one, so the goals are gone through until all
//   of them in a row left Z as it was.  Then what each recorded is right for
//   the final Z, and the strategy needs no further pass.
// - X of a goal's k-th round starts from Z and from what the same round gave
//   the last time: everything is monotone in Z (Piterman, Pnueli and Sa'ar,
//   VMCAI 2006).  For an assumption that is true X is a single step.

#include "fixpoint.hpp"

namespace slugs {

Fixpoint::Fixpoint(Game &game, bool robotics_init, bool bias_for_action, Statistics &statistics)
    : game_(game), robotics_init_(robotics_init), bias_for_action_(bias_for_action), statistics_(statistics),
      z_(game.states), progress_(game.guarantees.size()) {}

void Fixpoint::close_under_safety() {
  for (;;) {
    ++statistics_.safety_iterations;
    const Bdd next = z_ & game_.controllable(game_.store.to_next(z_));
    if (next == z_)
      return;
    z_ = next;
    between_steps();
  }
}

bool Fixpoint::solve() {
  close_under_safety();
  statistics_.y_iterations.assign(progress_.size(), 0);
  statistics_.x_iterations.assign(progress_.size(), 0);
  std::size_t agreeing = 0;
  for (std::size_t j = 0; agreeing < progress_.size(); j = (j + 1) % progress_.size()) {
    if (j == 0)
      ++statistics_.outer_iterations;
    if (!game_.wins_initially(z_, robotics_init_))
      return false;
    const Bdd y = reach_goal(j);
    ++agreeing;
    if (y != z_) {
      agreeing = 0;
      z_ = y;
      close_under_safety();
    }
  }
  return game_.wins_initially(z_, robotics_init_);
}

Bdd Fixpoint::wait(const Bdd &targets, const Bdd &start, std::size_t assumption, std::uint64_t &iterations) {
  const Bdd failing = !game_.assumptions[assumption];
  Bdd x = start;
  for (;;) {
    ++iterations;
    const Bdd next = z_ & game_.controllable(targets | (failing & game_.store.to_next(x)));
    if (next == x || failing.is_false())
      return next;
    x = next;
    between_steps();
  }
}

Bdd Fixpoint::reach_goal(std::size_t j) {
  BddStore &store = game_.store;
  const GoalProgress before = std::move(progress_[j]);
  progress_[j].clear();
  const Bdd goal = game_.guarantees[j] & store.to_next(z_);
  Bdd y = store.constant(false);
  for (std::size_t k = 0;; ++k) {
    ++statistics_.y_iterations[j];
    Round round;
    Bdd larger = y;
    if (bias_for_action_) {
      for (;;) {
        round.steps.push_back(larger);
        const Bdd next = larger | (z_ & game_.controllable(goal | store.to_next(larger)));
        if (next == larger)
          break;
        larger = next;
        between_steps();
      }
    }
    round.closer = larger;
    const Bdd targets = goal | store.to_next(round.closer);
    for (std::size_t i = 0; i < game_.assumptions.size(); ++i) {
      const Bdd start = k < before.size() ? z_ & before[k].waiting[i] : z_;
      round.waiting.push_back(wait(targets, start, i, statistics_.x_iterations[j]));
      larger |= round.waiting.back();
    }
    const bool done = larger == y;
    progress_[j].push_back(std::move(round));
    if (done)
      return y;
    y = larger;
    between_steps();
  }
}

} // namespace slugs
