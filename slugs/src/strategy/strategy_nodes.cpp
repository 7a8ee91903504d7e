// See strategy/strategy_nodes.hpp.
//
// The positional strategy of a guarantee, cofactored by a state, is a function
// of next variables that determines the successors.  Games have far more states than
// such functions, so lists of successors are cached by function and rank.  A cached
// list contains only nodes that already have numbers, so caching does not affect the
// numbering.

#include "strategy/strategy_nodes.hpp"

namespace slugs {

StrategyNodes::StrategyNodes(Game &game, StrategySteps &steps)
    : game_(game), steps_(steps), nodes_(words_for(game.store.bits()), game.store.account()),
      state_(words_for(game.store.bits())) {}

bool StrategyNodes::begin(const Bdd &initial, std::size_t most) {
  std::vector<Word> valuation(state_.size());
  return add_initial_nodes(initial.edge(), 0, valuation, most);
}

// Enumerate valuations in lexicographic order of the declared variables.
bool StrategyNodes::add_initial_nodes(Edge f, std::uint32_t bit, std::vector<Word> &valuation,
                                      std::size_t most) {
  if (f == bdd_false)
    return true;
  if (bit == game_.store.bits()) {
    if ((nodes_.intern(valuation.data(), 0) & 0x3FF) == 0)
      game_.store.account().budget().check();
    return nodes_.size() <= most;
  }
  if (!add_initial_nodes(game_.store.edges().cofactor(f, current_var(bit), false), bit + 1, valuation, most))
    return false;
  set_bit(valuation.data(), bit);
  const bool all =
      add_initial_nodes(game_.store.edges().cofactor(f, current_var(bit), true), bit + 1, valuation, most);
  reset_bit(valuation.data(), bit);
  return all;
}

const std::vector<std::uint64_t> &StrategyNodes::expand(std::size_t id) {
  // Copy the state, since interning successors may reallocate the table.
  state_.assign(nodes_.state(id), nodes_.state(id) + state_.size());
  const Edge f = steps_.allowed.transitions(state_.data(), nodes_.rank(id));
  const Ranks::Step step = steps_.ranks.from(state_.data(), nodes_.rank(id));
  const auto [place, fresh] = successors_.try_emplace(Key{f, step.rank, step.signature});
  std::vector<std::uint64_t> &list = place->second;
  if (fresh) {
    const PackedStates &found = steps_.successors.of(f);
    list.reserve(found.size());
    for (std::size_t i = 0; i < found.size(); ++i)
      list.push_back(nodes_.intern(found[i], steps_.ranks.advance(step, found[i])));
    remembered_numbers_ += list.size() + 8;
  }
  return list;
}

void StrategyNodes::collect_if_due() {
  game_.store.account().budget().check();
  if (steps_.should_collect() || !room_to_remember()) {
    forget();
    steps_.forget();
  }
}

void StrategyNodes::forget() {
  successors_.clear();
  remembered_numbers_ = 0;
}

bool StrategyNodes::room_to_remember() const {
  constexpr std::size_t most = 1u << 22;
  return remembered_numbers_ < most &&
         game_.store.account().has_room(2 * remembered_numbers_ * sizeof(std::uint64_t));
}

} // namespace slugs
