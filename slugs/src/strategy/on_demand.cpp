// See strategy/on_demand.hpp.  Uses the diagrams of the extraction, restricted to one
// input.

#include "strategy/on_demand.hpp"

#include <cassert>
#include <stdexcept>
#include <utility>

namespace slugs {

namespace {

std::vector<Word> packed(const std::vector<bool> &state) {
  std::vector<Word> words(words_for(state.size()));
  for (std::size_t bit = 0; bit < state.size(); ++bit)
    if (state[bit])
      set_bit(words.data(), bit);
  return words;
}

} // namespace

OnDemandStrategy::OnDemandStrategy(Game &game, const Fixpoint &fixpoint)
    : game_(game), fixpoint_(fixpoint), initial_(fixpoint.winning() & game.env_init & game.sys_init),
      steps_(game, fixpoint), no_collection_(game.store) {
  steps_.prepare();
}

std::optional<Position> OnDemandStrategy::start(const Values &values) {
  BddStore &store = game_.store;
  collect_if_due();
  // Fix the given values first; then the others can be chosen without backtracking.
  Edge f = initial_.edge();
  for (std::uint32_t bit = 0; bit < values.size(); ++bit)
    if (values[bit])
      f = store.edges().cofactor(f, current_var(bit), *values[bit]);
  if (f == bdd_false)
    return std::nullopt;
  std::vector<bool> state(values.size());
  for (std::uint32_t bit = 0; bit < values.size(); ++bit) {
    if (values[bit]) {
      state[bit] = *values[bit];
      continue;
    }
    const Edge low = store.edges().cofactor(f, current_var(bit), false);
    state[bit] = low == bdd_false;
    f = state[bit] ? store.edges().cofactor(f, current_var(bit), true) : low;
  }
  return position(std::move(state), 0);
}

std::optional<Position> OnDemandStrategy::find(const Values &values, std::size_t most) {
  collect_if_due();
  bool begun = true;
  if (!explored_) {
    explored_.emplace(game_, steps_);
    expanded_ = 0;
    begun = explored_->begin(initial_, most);
  }
  const std::optional<std::size_t> found = position_of(values, most);
  std::optional<Position> result;
  if (found) {
    const NodeTable &nodes = explored_->nodes();
    std::vector<bool> state(values.size());
    for (std::size_t bit = 0; bit < state.size(); ++bit)
      state[bit] = get_bit(nodes.state(*found), bit);
    result = position(std::move(state), nodes.rank(*found));
  }
  // An incomplete set of initial nodes cannot be extended: restart next time.
  if (!begun)
    explored_.reset();
  else if (!found)
    explored_->forget();
  return result;
}

// Return the first node below `most` with these values, expanding nodes as needed.
std::optional<std::size_t> OnDemandStrategy::position_of(const Values &values, std::size_t most) {
  const NodeTable &nodes = explored_->nodes();
  const auto is_wanted = [&](const Word *state) {
    for (std::size_t bit = 0; bit < values.size(); ++bit)
      if (values[bit] && *values[bit] != get_bit(state, bit))
        return false;
    return true;
  };
  for (std::size_t id = 0; id < most; ++id) {
    while (id == nodes.size()) {
      if (expanded_ == nodes.size())
        return std::nullopt;
      if ((expanded_ & 0x3FF) == 0)
        explored_->collect_if_due();
      explored_->expand(expanded_++);
    }
    if (is_wanted(nodes.state(id)))
      return id;
  }
  return std::nullopt;
}

std::variant<Move, Refusal> OnDemandStrategy::move(const std::vector<bool> &state, std::uint32_t goal,
                                                   const std::vector<bool> &inputs) {
  assert(goal < game_.guarantees.size() && state.size() == game_.store.bits() &&
         inputs.size() == state.size());
  BddStore &store = game_.store;
  collect_if_due();
  std::vector<bool> values(2 * state.size());
  for (std::uint32_t bit = 0; bit < state.size(); ++bit)
    values[current_var(bit)] = state[bit];
  if (!store.evaluate(fixpoint_.winning().edge(), values))
    return Refusal::StateNotWinning;
  const std::vector<Word> words = packed(state);
  const Edge f = steps_.allowed.transitions(words.data(), goal, input_cube(inputs));
  if (f == bdd_false)
    return Refusal::InputsNotAllowed;
  const Word *const found = steps_.successors.of(f)[0];
  const Ranks::Step step = steps_.ranks.from(words.data(), goal);
  const std::uint32_t next_goal = steps_.ranks.advance(step, found);
  std::vector<bool> next(state.size());
  for (std::uint32_t bit = 0; bit < state.size(); ++bit)
    values[next_var(bit)] = next[bit] = get_bit(found, bit);
  const auto count = static_cast<std::uint32_t>(game_.guarantees.size());
  const bool any_met = store.evaluate(game_.guarantees[goal].edge(), values);
  const std::uint32_t met = any_met ? (next_goal + count - goal - 1) % count + 1 : 0;
  return Move{position(std::move(next), next_goal), met};
}

Position OnDemandStrategy::position(std::vector<bool> state, std::uint32_t goal) const {
  const auto value_of = [&](Var v) -> bool { return state[v / 2]; };
  std::uint64_t distance = 0;
  for (const Round &round : fixpoint_.progress()[goal]) {
    for (const FrozenBdd &step : round.steps) {
      if (step.evaluate(value_of))
        return {std::move(state), goal, distance, std::nullopt};
      ++distance;
    }
    for (std::uint32_t i = 0; i < round.waiting.size(); ++i) {
      if (round.waiting[i].evaluate(value_of)) {
        // The constant true stands for a missing assumption, which justifies no waiting.
        const bool excuses = !game_.assumptions[i].is_true();
        return {std::move(state), goal, distance, excuses ? std::optional(i) : std::nullopt};
      }
      ++distance;
    }
  }
  throw std::logic_error("a winning state without a way to its guarantee");
}

// Build the cube of the next inputs, bottom up.
Edge OnDemandStrategy::input_cube(const std::vector<bool> &inputs) {
  BddStore &store = game_.store;
  Edge cube = bdd_true;
  for (std::uint32_t level = 2 * store.bits(); level-- > 0;) {
    const Var v = store.var_at(level);
    if (v % 2 == 0 || game_.specification.variables[v / 2].owner != Owner::Input)
      continue;
    cube = inputs[v / 2] ? store.edges().node(v, bdd_false, cube) : store.edges().node(v, cube, bdd_false);
  }
  return cube;
}

void OnDemandStrategy::collect_if_due() {
  if (!steps_.should_collect())
    return;
  if (explored_)
    explored_->forget();
  steps_.forget();
}

} // namespace slugs
