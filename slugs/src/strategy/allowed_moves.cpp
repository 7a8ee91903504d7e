// The order of the steps determines the strategy: round by round, within a round
// first the plain steps (bias for action), then assumption by assumption.  A step
// offers
//
//   SYS_TRANS & ( (G_j & Z') | closer' | (!A_i & waiting_i') )
//
// and serves the pairs of a state and an input that no earlier step serves.
// Moves with a response into the former part of `closer` are already served, so only its
// new part is examined, and of `waiting_i` only the part outside of `closer`.
//
// The union of all steps is a relation over both copies of all variables and can be
// far larger than its factors: the parts of the environment, the pairs served by each
// step, SYS_TRANS, and the targets of each step.  So the factors are stored, and
// conjoined only after they have been cofactored by a state.

#include "strategy/allowed_moves.hpp"

#include <cassert>

namespace slugs {

namespace {

// Numbering of disjoint sets in the order of add(), with, for each binary digit, the
// union of the sets whose number has it set.  Like carries in a binary counter, sets
// are joined in pairs, pairs in fours, and so on, so that large sets are joined rarely.
class Numbering {
public:
  explicit Numbering(BddStore &store) : store_(store) {}

  void add(const Bdd &set) {
    assert(blocks_.empty() || (blocks_.back().all & set).is_false()); // disjoint
    blocks_.push_back({set, {}});
    for (std::size_t n = ++count_; n % 2 == 0; n /= 2)
      join_last_two();
  }

  std::vector<Bdd> digits() {
    while (blocks_.size() > 1) {
      // Pad the last block with empty sets.
      while (blocks_.back().digits.size() < blocks_[blocks_.size() - 2].digits.size())
        blocks_.back().digits.push_back(store_.constant(false));
      join_last_two();
    }
    assert(blocks_.empty() || count_ <= std::size_t{1} << blocks_.back().digits.size());
    return blocks_.empty() ? std::vector<Bdd>{} : blocks_.back().digits;
  }

private:
  struct Block { // of 2^digits.size() sets
    Bdd all;
    std::vector<Bdd> digits;
  };

  void join_last_two() {
    assert(blocks_.size() >= 2);
    const Block upper = blocks_.back();
    blocks_.pop_back();
    Block &lower = blocks_.back();
    assert(lower.digits.size() == upper.digits.size());
    for (std::size_t b = 0; b < lower.digits.size(); ++b)
      lower.digits[b] |= upper.digits[b];
    lower.digits.push_back(upper.all);
    lower.all |= upper.all;
  }

  BddStore &store_;
  std::vector<Block> blocks_;
  std::size_t count_ = 0;
};

} // namespace

AllowedMoves::AllowedMoves(Game &game, const Fixpoint &fixpoint)
    : game_(game), environment_(game.environment(fixpoint.winning())) {
  const Bdd moves = environment_.size() == 1 ? environment_[0] : game.moves_from(fixpoint.winning());
  for (std::size_t j = 0; j < game.guarantees.size(); ++j)
    goals_.push_back(steps_towards(fixpoint.winning(), moves, fixpoint.progress()[j], j));
}

AllowedMoves::Goal AllowedMoves::steps_towards(const Bdd &winning, const Bdd &moves,
                                               const GoalProgress &progress, std::size_t j) {
  BddStore &store = game_.store;
  assert(j < game_.guarantees.size() && !progress.empty());
  Goal goal;
  Numbering numbering(store);
  Bdd open = moves;
  Bdd targets = game_.guarantees[j] & store.to_next(winning);
  Bdd closer = store.constant(false);
  const auto come_closer = [&](const Bdd &larger) {
    assert(store.implies(closer, larger)); // each step is closer than the next
    targets |= store.to_next(larger & !closer);
    closer = larger;
  };
  const auto take = [&] {
    if (targets.is_false())
      return;
    const Bdd served = open & store.and_exists(game_.sys_trans, targets, game_.next_outputs);
    if (!served.is_false()) {
      numbering.add(served);
      goal.targets.push_back(targets);
    }
    assert(store.implies(served, open)); // a move belongs to the earliest step that serves it
    open &= !served;
    targets = store.constant(false);
  };
  Bdd reached = closer;
  for (const Round &round : progress) {
    for (const FrozenBdd &step : round.steps) {
      reached |= step.thaw(store);
      come_closer(reached);
      take();
    }
    come_closer(reached);
    for (std::size_t i = 0; i < round.waiting.size() && !open.is_false(); ++i) {
      const Bdd waiting = round.waiting[i].thaw(store);
      targets |= (!game_.assumptions[i]) & store.to_next(waiting & !closer);
      take();
      reached |= waiting;
    }
    if (open.is_false())
      break;
  }
  assert(open.is_false()); // each move from a winning state is answered
  goal.bits = numbering.digits();
  assert(goal.targets.size() <= std::size_t{1} << goal.bits.size());
  return goal;
}

void AllowedMoves::prepare_cofactors() {
  std::vector<Bdd> functions = environment_;
  functions.push_back(game_.sys_trans);
  for (const Goal &goal : goals_) {
    functions.insert(functions.end(), goal.bits.begin(), goal.bits.end());
    functions.insert(functions.end(), goal.targets.begin(), goal.targets.end());
  }
  cofactor_ = std::make_unique<StateCofactor>(game_.store, functions);
}

void AllowedMoves::forget() {
  assert(cofactor_);
  cofactor_->forget();
}

Edge AllowedMoves::transitions(const Word *state, std::size_t j) {
  assert(j < goals_.size() && cofactor_);
  const Goal &goal = goals_[j];
  Edge open = bdd_true;
  for (const Bdd &part : environment_)
    open = game_.store.edges().conjunction(open, (*cofactor_)(part.edge(), state));
  const Edge result = collect_steps(goal, state, open, goal.bits.size(), 0);
  assert(game_.store.edges().is_empty(game_.next_outputs) ||
         game_.store.edges().exists(result, game_.next_outputs) == open); // each input has an answer
  return result;
}

// Split the inputs by the digits of their step number, most significant first.
Edge AllowedMoves::collect_steps(const Goal &goal, const Word *state, Edge inputs, std::size_t bits,
                                 std::size_t step) {
  Operations &edges = game_.store.edges();
  if (inputs == bdd_false)
    return bdd_false;
  assert(bits <= goal.bits.size());
  if (bits == 0) {
    assert(step < goal.targets.size());
    const Edge answers = edges.conjunction(inputs, (*cofactor_)(game_.sys_trans.edge(), state));
    return edges.conjunction(answers, (*cofactor_)(goal.targets[step].edge(), state));
  }
  const std::size_t b = bits - 1;
  const Edge digit = (*cofactor_)(goal.bits[b].edge(), state);
  const Edge with =
      collect_steps(goal, state, edges.conjunction(inputs, digit), b, step | std::size_t{1} << b);
  const Edge without = collect_steps(goal, state, edges.conjunction(inputs, digit ^ 1), b, step);
  return edges.disjunction(with, without);
}

} // namespace slugs
