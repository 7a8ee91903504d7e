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
//   VMCAI 2006).
// - The environment's moves that the system can answer by coming closer are taken
//   away once: a step of Y answers those that are left by what the step before has
//   added to Y, and a step of X asks only whether those of X that are left can be
//   answered by staying in X.  Each is one operation, which looks at nothing but
//   these moves.

#include "game/fixpoint.hpp"

#include <algorithm>
#include <utility>

namespace slugs {

Fixpoint::Fixpoint(Game &game, bool robotics_init, Steps order, Statistics &statistics)
    : game_(game), robotics_init_(robotics_init), order_(order), statistics_(statistics), z_(game.states),
      progress_(game.guarantees.size()), settled_(game.guarantees.size()), reached_(game) {
  for (const Bdd &assumption : game.assumptions) {
    const std::vector<Var> support = game.store.support(assumption);
    decided_by_input_.push_back(std::none_of(support.begin(), support.end(), [&](Var v) {
      return v % 2 == 1 && game.specification.variables[v / 2].owner == Owner::Output;
    }));
  }
}

// The largest part of `start` in which the system can stay for as long as the
// environment moves by `moves`, with transitions that are `allowed`:
//
//   nu X. start & forall x'. moves -> exists y'. SYS_TRANS & allowed & X'
Bdd Fixpoint::stay(const Bdd &start, const Bdd &moves, const Bdd &allowed, std::uint64_t &iterations) {
  BddStore &store = game_.store;
  Bdd x = start;
  Bdd open = game_.narrowed(moves, x);
  const auto step = [&] {
    const Bdd unanswered =
        store.minus_exists_both(open, game_.sys_trans, allowed & store.to_next(x), game_.next_outputs);
    return game_.origins(unanswered);
  };
  for (;;) {
    ++iterations;
    const Bdd lost = step();
    const Bdd kept = x & !lost;
    if (kept == x)
      return x;
    x = kept;
    open = game_.narrowed(open, !lost);
    game_.reordering.between_steps(step);
  }
}

// Keeps to states with no move of the environment that stops the system, so that
// `sys_trans` is all that restricts answers.
void Fixpoint::leave_stuck_states() { z_ &= !game_.stuck_states(); }

void Fixpoint::close_under_safety() {
  z_ = stay(z_, game_.moves_from(z_), game_.store.constant(true), statistics_.safety_iterations);
}

bool Fixpoint::solve() {
  leave_stuck_states();
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
      reached_.clear();
      z_ = y;
      close_under_safety();
    }
  }
  return game_.wins_initially(z_, robotics_init_);
}

// The states of `start` from which the system can answer every move of `open`
// with a transition into the result on which the assumption fails.
Bdd Fixpoint::wait(const Bdd &open, const Bdd &start, std::size_t i, std::uint64_t &iterations) {
  BddStore &store = game_.store;
  const Bdd &assumption = game_.assumptions[i];
  if (!decided_by_input_[i])
    return stay(start, open, !assumption, iterations);
  // Where the environment can satisfy the assumption, waiting is lost immediately.
  const Bdd x = start & !game_.origins(open, assumption);
  if (assumption.is_true())
    return x;
  return stay(x, open & !assumption, store.constant(true), iterations);
}

Bdd Fixpoint::reach_goal(std::size_t j) {
  BddStore &store = game_.store;
  const GoalProgress before = std::move(progress_[j]);
  progress_[j].clear();
  // A round's waiting lies within that of the same round before, when Z was
  // larger.  Rounds beyond the last one before lie within the last only if Y
  // had stopped growing there; if Y had reached Z, nothing is known of them.
  const bool settled = settled_[j];
  settled_[j] = true;
  // What the environment may do that the system cannot answer by coming closer.
  const Bdd moves = game_.moves_from(z_);
  Bdd open = moves;
  const auto answer = [&](const Bdd &targets) {
    const auto step = [&] {
      return store.minus_exists_both(open, game_.sys_trans, targets, game_.next_outputs);
    };
    open = step();
    game_.reordering.between_steps(step);
  };
  answer(game_.guarantees[j] & store.to_next(z_));
  const bool verdict_only = order_ == Steps::Fewest;
  const Bdd last = verdict_only ? moves & !open : Bdd();
  const auto finish = [&](const Bdd &y) {
    if (verdict_only && y == z_)
      reached_.add(last);
    return y;
  };
  const auto covered = [&] {
    if (!verdict_only || !reached_.covered(open))
      return false;
    settled_[j] = false;
    progress_[j].clear();
    return true;
  };
  Bdd y = store.constant(false);
  for (std::size_t k = 0;; ++k) {
    ++statistics_.y_iterations[j];
    if (covered())
      return finish(z_);
    Round round;
    Bdd larger = y;
    // Upstream waits with the targets with which the round began, so with a bias
    // for action not with those that the plain steps have just added.
    const Bdd open_before = order_ == Steps::BiasForAction ? open : Bdd();
    if (order_ != Steps::Plain) {
      // Steps that rely on no assumption are far cheaper than waiting.
      for (;;) {
        if (order_ == Steps::BiasForAction)
          round.steps.emplace_back(store, larger);
        const Bdd next = larger | (z_ & !game_.origins(open));
        if (next == larger)
          break;
        answer(store.to_next(next & !larger));
        larger = next;
        if (covered())
          return finish(z_);
      }
      if (verdict_only && larger == z_) {
        // Waiting can add nothing.  What it would have found is at most Z.
        for (std::size_t i = 0; i < game_.assumptions.size(); ++i)
          round.waiting.emplace_back(store, z_);
        progress_[j].push_back(std::move(round));
        return finish(larger);
      }
    }
    const Bdd answered = larger; // what leads there is no longer open
    const Bdd &unanswered = order_ == Steps::BiasForAction ? open_before : open;
    const Bdd &closer = order_ == Steps::BiasForAction ? y : answered;
    for (std::size_t i = 0; i < game_.assumptions.size(); ++i) {
      // Who can come closer need not wait, and nobody waits for who can.
      Bdd start = z_ & !closer;
      if (!before.empty() && (settled || k < before.size()))
        start &= before[std::min(k, before.size() - 1)].waiting[i].thaw(store);
      const Bdd waiting = closer | wait(unanswered, start, i, statistics_.x_iterations[j]);
      round.waiting.emplace_back(store, waiting);
      larger |= waiting;
    }
    // Y cannot outgrow Z.
    const bool done = larger == y || larger == z_;
    progress_[j].push_back(std::move(round));
    if (done) {
      settled_[j] = larger == y;
      return finish(larger);
    }
    answer(store.to_next(larger & !answered));
    y = larger;
  }
}

} // namespace slugs
