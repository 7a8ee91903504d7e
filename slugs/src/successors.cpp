// Enumeration follows the paths of the diagram in whatever order its variables
// are and sorts afterwards.  The diagram may hold many outputs for an input;
// while they are few it is cheapest to find them all and drop all but the
// least, otherwise the diagram is first reduced to the least outputs.

#include "successors.hpp"

#include <algorithm>

namespace slugs {

Successors::Successors(Game &game)
    : game_(game), input_mask_(words_for(game.store.bits())), valuation_(words_for(game.store.bits())),
      found_(words_for(game.store.bits())) {
  const std::vector<Variable> &variables = game.specification.variables;
  for (std::uint32_t bit = 0; bit < variables.size(); ++bit) {
    by_level_.push_back(next_var(bit));
    is_input_.push_back(variables[bit].owner == Owner::Input);
    if (is_input_.back())
      set_bit(input_mask_.data(), bit);
    else
      outputs_.push_back(bit);
  }
  std::sort(by_level_.begin(), by_level_.end(),
            [&](Var a, Var b) { return game.store.level_of(a) < game.store.level_of(b); });
  std::vector<Var> later;
  outputs_from_.resize(outputs_.size());
  for (std::size_t k = outputs_.size(); k-- > 0;) {
    later.push_back(next_var(outputs_[k]));
    outputs_from_[k] = game.store.make_set(later);
  }
}

const PackedStates &Successors::least(Edge f) {
  constexpr std::size_t few = 256;
  found_.clear();
  all_outputs_ = false;
  limit_ = few;
  if (enumerate(f, 0)) {
    found_.keep_least_for_each(input_mask_);
    return found_;
  }
  found_.clear();
  std::fill(valuation_.begin(), valuation_.end(), 0);
  limit_ = static_cast<std::size_t>(-1);
  enumerate(least_outputs(f), 0);
  found_.sort();
  return found_;
}

const PackedStates &Successors::all(Edge f) {
  found_.clear();
  all_outputs_ = true;
  limit_ = static_cast<std::size_t>(-1);
  enumerate(f, 0);
  found_.sort();
  return found_;
}

// Appends what f allows of by_level_[k..]; false if there are too many.
bool Successors::enumerate(Edge f, std::size_t k) {
  if (f == bdd_false)
    return true;
  if (k == by_level_.size()) {
    if ((found_.size() & 0x3FF) == 0x3FF)
      check_limits();
    found_.push_back(valuation_.data());
    return found_.size() <= limit_;
  }
  const Var v = by_level_[k];
  const std::uint32_t bit = v / 2;
  const bool branches = f > 1 && game_.store.var_of(f) == v;
  if (!enumerate(branches ? game_.store.low_of(f) : f, k + 1))
    return false;
  if (!branches && !is_input_[bit] && !all_outputs_)
    return true; // 0 is the least
  set_bit(valuation_.data(), bit);
  const bool complete = enumerate(branches ? game_.store.high_of(f) : f, k + 1);
  reset_bit(valuation_.data(), bit);
  return complete;
}

// A state may have more successors than memory can hold.
void Successors::check_limits() const {
  MemoryAccount &account = game_.store.account();
  account.budget().check();
  constexpr std::size_t copies = 4; // while sorting, and as numbers
  if (!account.has_room(copies * found_.bytes()))
    MemoryAccount::refuse();
}

Edge Successors::least_outputs(Edge f) {
  BddStore &store = game_.store;
  Bdd result(store, f);
  for (std::size_t k = 0; k < outputs_.size(); ++k) {
    const Bdd zero = !store.variable(next_var(outputs_[k]));
    const Bdd with_zero = result & zero;
    result = with_zero | (result & !store.exists(with_zero, outputs_from_[k]));
  }
  return result.edge();
}

} // namespace slugs
