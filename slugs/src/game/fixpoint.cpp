// Goals reached earlier, the fixpoint of the system, the fixpoint of the environment.

#include "game/fixpoint.hpp"

#include <algorithm>
#include <cassert>
#include <optional>
#include <utility>

namespace slugs {

void ReachedGoals::add(const Bdd &last) {
  if (!last.is_false())
    goals_.push_back({FrozenBdd(store_, last), store_.some_valuation(last)});
}

// Check the latest goal first: goals near each other are often listed consecutively.
bool ReachedGoals::covered(const Bdd &open) {
  assert(store_.work() >= work_at_start_);
  for (std::size_t i = goals_.size(); i-- > 0;) {
    Goal &goal = goals_[i];
    if (store_.evaluate(open.edge(), goal.uncovered))
      continue;
    const std::uint64_t work = store_.work();
    if (check_work_ > (work - work_at_start_) / store_.tuning().reached_share)
      return false;
    const Bdd uncovered = goal.last.thaw(store_) & open;
    check_work_ += store_.work() - work + goal.last.size();
    if (uncovered.is_false())
      return true;
    goal.uncovered = store_.some_valuation(uncovered);
    assert(store_.evaluate(open.edge(), goal.uncovered));
  }
  return false;
}

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

Fixpoint::Fixpoint(Game &game, bool robotics_init, Steps order)
    : game_(game), robotics_init_(robotics_init), order_(order), z_(game.states),
      progress_(game.guarantees.size()), y_converged_(game.guarantees.size()), reached_(game) {
  for (const Bdd &assumption : game.assumptions) {
    const std::vector<Var> support = game.store.support(assumption);
    assert(!assumption.is_false() || support.empty());
    decided_by_input_.push_back(std::none_of(support.begin(), support.end(), [&](Var v) {
      return v % 2 == 1 && game.specification.variables[v / 2].owner == Owner::Output;
    }));
  }
}

// Return the largest subset of `start` in which the system can stay while the
// environment chooses from `moves`, using `allowed` transitions only:
//
//   nu X. start & forall x'. moves -> exists y'. SYS_TRANS & allowed & X'
Bdd Fixpoint::stay(const Bdd &start, const Bdd &moves, const Bdd &allowed) {
  BddStore &store = game_.store;
  Bdd x = start;
  Bdd open = game_.narrowed(moves, x);
  const auto step = [&] {
    const Bdd unanswered =
        store.minus_and_exists(open, game_.sys_trans, allowed & store.to_next(x), game_.next_outputs);
    return game_.sources(unanswered);
  };
  for (;;) {
    const Bdd lost = step();
    const Bdd kept = x & !lost;
    assert(store.implies(kept, x)); // decreases
    if (kept == x) {
      assert(store.implies(x, start));
      return x;
    }
    x = kept;
    open = game_.narrowed(open, !lost);
    game_.reordering.between_steps(step);
  }
}

// Remove the states in which the environment can deadlock the system, so that only
// `sys_trans` restricts the system's responses.
void Fixpoint::leave_stuck_states() { z_ &= !game_.stuck_states(); }

void Fixpoint::close_under_safety() {
  const Bdd before = z_;
  z_ = stay(z_, game_.moves_from(z_), game_.store.constant(true));
  assert(game_.store.implies(z_, before));
}

bool Fixpoint::solve() {
  assert(!progress_.empty() && outer_iterations_ == 0);
  leave_stuck_states();
  close_under_safety();
  std::size_t agreeing = 0;
  for (std::size_t j = 0; agreeing < progress_.size(); j = (j + 1) % progress_.size()) {
    if (j == 0)
      ++outer_iterations_;
    if (!game_.wins_initially(z_, robotics_init_))
      return false;
    const Bdd y = reach_goal(j);
    assert(game_.store.implies(y, z_)); // Z decreases
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
Bdd Fixpoint::wait(const Bdd &open, const Bdd &start, std::size_t i) {
  BddStore &store = game_.store;
  assert(i < game_.assumptions.size() && store.owns(start));
  const Bdd &assumption = game_.assumptions[i];
  if (!decided_by_input_[i])
    return stay(start, open, !assumption);
  // The system cannot wait where the environment can meet the assumption.
  const Bdd x = start & !game_.sources(open, assumption);
  if (assumption.is_true())
    return x;
  assert(store.implies(x, start));
  return stay(x, open & !assumption, store.constant(true));
}

// The middle fixpoint (Y) for guarantee j: the states of Z from which the system meets the
// goal or stays where an assumption is not met.
class Fixpoint::GoalFixpoint {
public:
  GoalFixpoint(Fixpoint &fixpoint, std::size_t j)
      : fixpoint_(fixpoint), game_(fixpoint.game_), store_(game_.store), z_(fixpoint.z_),
        order_(fixpoint.order_), progress_(fixpoint.progress_[j]), converged_(fixpoint.y_converged_[j]),
        before_(std::exchange(progress_, {})), all_bounded_(std::exchange(converged_, true)),
        moves_(game_.moves_from(z_)), open_(moves_) {
    assert(progress_.empty());
    answer(game_.guarantees[j] & store_.to_next(z_));
    if (verdict_only())
      met_ = moves_ & !open_;
  }

  Bdd solve() {
    Bdd y = store_.constant(false);
    for (;;) {
      if (covered())
        return finish(z_);
      Round round;
      // Upstream computes waiting sets from the targets at the start of the round.  With
      // a bias for action these exclude the targets that the plain steps have just added.
      const Bdd open_before = order_ == Steps::BiasForAction ? open_ : Bdd();
      const std::optional<Bdd> closer = order_ == Steps::Plain ? y : step_closer(round, y);
      if (!closer)
        return finish(z_);
      if (verdict_only() && *closer == z_) {
        // Waiting cannot add states; Z bounds the skipped waiting sets.
        for (std::size_t i = 0; i < game_.assumptions.size(); ++i)
          round.waiting.emplace_back(store_, z_);
        progress_.push_back(std::move(round));
        return finish(z_);
      }
      const bool biased = order_ == Steps::BiasForAction;
      assert(store_.implies(y, *closer));
      const Bdd larger = *closer | wait(round, biased ? open_before : open_, biased ? y : *closer);
      assert(store_.implies(*closer, larger) && store_.implies(larger, z_)); // Y increases within Z
      progress_.push_back(std::move(round));
      if (larger == y || larger == z_) { // Y cannot outgrow Z.
        converged_ = larger == y;
        return finish(larger);
      }
      answer(store_.to_next(larger & !*closer));
      y = larger;
    }
  }

private:
  bool verdict_only() const { return order_ == Steps::Fewest; }

  // Leave open what the system cannot answer by moving to `targets`.
  void answer(const Bdd &targets) {
    const auto step = [&] {
      return store_.minus_and_exists(open_, game_.sys_trans, targets, game_.next_outputs);
    };
    {
      // Not beyond this block: a handle would take part in sifting.
      [[maybe_unused]] const Bdd before = open_;
      open_ = step();
      assert(store_.implies(open_, before)); // answered moves stay answered
    }
    game_.reordering.between_steps(step);
  }

  // Return whether the moves that are open are known to be answered; only the verdict
  // follows from that.
  bool covered() {
    if (!verdict_only() || !fixpoint_.reached_.covered(open_))
      return false;
    assert(before_.empty() || !fixpoint_.progress_.empty());
    converged_ = false;
    progress_.clear();
    return true;
  }

  Bdd finish(const Bdd &y) {
    assert(verdict_only() || !progress_.empty());
    assert(store_.implies(y, z_) && store_.implies(open_, moves_));
    if (verdict_only() && y == z_)
      fixpoint_.reached_.add(met_);
    return y;
  }

  // Return the states that reach `y` without assumptions, which is far cheaper than
  // waiting sets; nothing if the open moves are covered.
  std::optional<Bdd> step_closer(Round &round, const Bdd &y) {
    Bdd closer = y;
    for (;;) {
      if (order_ == Steps::BiasForAction)
        round.steps.emplace_back(store_, closer);
      const Bdd next = closer | (z_ & !game_.sources(open_));
      assert(store_.implies(closer, next) && store_.implies(next, z_));
      if (next == closer)
        return closer;
      answer(store_.to_next(next & !closer));
      closer = next;
      if (covered())
        return std::nullopt;
    }
  }

  // Add the waiting sets of a round and return their union.  States in `closer` need not
  // wait.
  Bdd wait(Round &round, const Bdd &unanswered, const Bdd &closer) {
    // The waiting sets of a round are contained in those of the same round in the
    // previous iteration, when Z was larger.  Later rounds are contained in its last
    // round only if Y had converged there; if Y had reached Z, they have no known bound.
    const std::size_t k = progress_.size();
    assert(round.waiting.empty());
    const bool bounded = !before_.empty() && (all_bounded_ || k < before_.size());
    Bdd result = store_.constant(false);
    for (std::size_t i = 0; i < game_.assumptions.size(); ++i) {
      Bdd start = z_ & !closer;
      if (bounded)
        start &= before_[std::min(k, before_.size() - 1)].waiting[i].thaw(store_);
      const Bdd waiting = closer | fixpoint_.wait(unanswered, start, i);
      assert(store_.implies(closer, waiting) && store_.implies(waiting, z_));
      round.waiting.emplace_back(store_, waiting);
      result |= waiting;
    }
    assert(round.waiting.size() == game_.assumptions.size());
    return result;
  }

  Fixpoint &fixpoint_;
  Game &game_;
  BddStore &store_;
  const Bdd &z_;
  const Steps order_;
  GoalProgress &progress_;
  char &converged_;           // whether Y has converged to a set other than Z
  const GoalProgress before_; // rounds of the previous iteration
  const bool all_bounded_;    // whether the last round of before_ bounds all later rounds
  const Bdd moves_;
  Bdd open_; // moves of the environment that the system cannot answer by approaching the goal
  Bdd met_;  // moves that it can answer by meeting the goal; only if no strategy is requested
};

Bdd Fixpoint::reach_goal(std::size_t j) { return GoalFixpoint(*this, j).solve(); }

// The dual of the fixpoint above (compare Könighofer, Hofferek and
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

CounterFixpoint::CounterFixpoint(Game &game, const Bdd &losing, bool robotics_init)
    : game_(game), losing_(losing), robotics_init_(robotics_init), won_(game.store.constant(false)),
      moves_(game.assumptions.size(), game.store.constant(false)) {
  assert(moves_.size() == game.assumptions.size());
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
  assert(game_.store.implies(won_, losing_));
  const Bdd lost = game_.env_init & game_.sys_init & won_;
  if (robotics_init_)
    return lost;
  const Bdd all_lost = game_.env_init & !game_.store.and_exists(game_.sys_init, !won_, game_.current_outputs);
  return lost & all_lost;
}

Bdd CounterFixpoint::forcing(const Bdd &targets) {
  assert(game_.store.owns(targets));
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
    assert((won_ & fresh).is_false() && game_.store.implies(fresh, losing_));
    won_ |= fresh;
  }
}

// Add a stage: the states from which the environment can prevent goal j forever
// while it meets all assumptions infinitely often, or force the play into earlier
// stages.  Return whether there are any.
bool CounterFixpoint::prevent(std::size_t j) {
  BddStore &store = game_.store;
  assert(j < game_.guarantees.size());
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
        assert((x & fresh).is_false()); // layers are disjoint
        stage[i] |= moves & fresh;
        x |= fresh;
      }
      assert(store.implies(x, y)); // Y decreases
      y = x;
      if (y.is_false())
        return false;
    }
    if (y == before)
      break;
  }
  assert((won_ & y).is_false() && !y.is_false()); // each stage is new
  won_ |= y;
  for (std::size_t i = 0; i < stage.size(); ++i)
    moves_[i] |= stage[i];
  for ([[maybe_unused]] const Bdd &moves : moves_)
    assert(store.implies(moves, game_.env_trans & won_)); // legal moves of won states
  return true;
}

} // namespace slugs
