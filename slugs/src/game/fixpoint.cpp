// The three nested fixpoints of Bloem, Jobstmann, Piterman, Pnueli and Sa'ar
// (JCSS 2012), with liveness conditions over transitions as in Ehlers and Raman
// (CAV 2016):
//
//   nu Z. /\_j mu Y. \/_i nu X. cpre( (G_j & Z') | Y' | (!A_i & X') )
//
// - Z starts as the greatest fixpoint of cpre(Z'), which is cheap and contains
//   the result, and is closed again whenever a goal shrinks it.
// - Goals update Z in turn.  The strategy of a goal that was computed with a larger
//   Z may leave the present Z, so the goals are repeated until a full cycle leaves Z
//   unchanged.  Then the recorded rounds of every goal are valid for the final Z, and
//   the strategy needs no further pass.
// - X of the k-th round of a goal starts from Z intersected with the result of the
//   same round in the previous iteration, since all sets are monotone in Z (Piterman,
//   Pnueli and Sa'ar, VMCAI 2006).
// - Moves of the environment that the system can answer by approaching the goal are
//   removed as soon as they are found.  A step of Y checks the remaining moves against
//   the states that the previous step added to Y.  A step of X checks whether the
//   remaining moves from X can be answered by staying in X.  Each step is one BDD
//   operation, restricted to these moves.

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

// Return the largest subset of `start` in which the system can stay while the
// environment chooses from `moves`, using `allowed` transitions only:
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

// Remove the states in which the environment can deadlock the system, so that only
// `sys_trans` restricts the system's responses.
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

// Return the largest subset of `start` in which the system can answer every move of
// `open` by staying in the subset while assumption i is not met.
Bdd Fixpoint::wait(const Bdd &open, const Bdd &start, std::size_t i, std::uint64_t &iterations) {
  BddStore &store = game_.store;
  const Bdd &assumption = game_.assumptions[i];
  if (!decided_by_input_[i])
    return stay(start, open, !assumption, iterations);
  // The system cannot wait where the environment can meet the assumption.
  const Bdd x = start & !game_.origins(open, assumption);
  if (assumption.is_true())
    return x;
  return stay(x, open & !assumption, store.constant(true), iterations);
}

Bdd Fixpoint::reach_goal(std::size_t j) {
  BddStore &store = game_.store;
  const GoalProgress before = std::move(progress_[j]);
  progress_[j].clear();
  // The waiting sets of a round are contained in those of the same round in the
  // previous iteration, when Z was larger.  Later rounds are contained in its last
  // round only if Y had converged there; if Y had reached Z, they have no known bound.
  const bool settled = settled_[j];
  settled_[j] = true;
  // Moves of the environment that the system cannot answer by approaching the goal.
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
    // Upstream computes waiting sets from the targets at the start of the round.  With
    // a bias for action these exclude the targets that the plain steps have just added.
    const Bdd open_before = order_ == Steps::BiasForAction ? open : Bdd();
    if (order_ != Steps::Plain) {
      // Steps without assumptions are far cheaper than waiting sets.
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
        // Waiting cannot add states; Z bounds the skipped waiting sets.
        for (std::size_t i = 0; i < game_.assumptions.size(); ++i)
          round.waiting.emplace_back(store, z_);
        progress_[j].push_back(std::move(round));
        return finish(larger);
      }
    }
    const Bdd answered = larger; // moves that can be answered into this set are not open
    const Bdd &unanswered = order_ == Steps::BiasForAction ? open_before : open;
    const Bdd &closer = order_ == Steps::BiasForAction ? y : answered;
    for (std::size_t i = 0; i < game_.assumptions.size(); ++i) {
      // States that are already closer need not wait.
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
