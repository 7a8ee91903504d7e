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
  if (enumerate(f)) {
    found_.keep_least_for_each(input_mask_);
    return found_;
  }
  found_.clear();
  limit_ = static_cast<std::size_t>(-1);
  enumerate(least_outputs(f));
  found_.sort();
  return found_;
}

const PackedStates &Successors::all(Edge f) {
  found_.clear();
  all_outputs_ = true;
  limit_ = static_cast<std::size_t>(-1);
  enumerate(f);
  found_.sort();
  return found_;
}

// Appends what f allows; false if there are too many.
bool Successors::enumerate(Edge f) {
  switch (valuation_.size()) {
  case 1:
    return follow<1>(f, 0, {});
  case 2:
    return follow<2>(f, 0, {});
  default:
    std::fill(valuation_.begin(), valuation_.end(), 0);
    return follow_wide(f, 0);
  }
}

bool Successors::keep(const Word *valuation) {
  if ((found_.size() & 0x3FF) == 0x3FF)
    check_limits();
  found_.push_back(valuation);
  return found_.size() <= limit_;
}

// What f allows of by_level_[k..].  This is where most of the time of a large
// extraction goes: valuations of a word or two are handed on by value, and only
// where both values are possible does it recur.
template <std::size_t Words>
bool Successors::follow(Edge f, std::size_t k, std::array<Word, Words> valuation) {
  if (f == bdd_false)
    return true;
  for (; k < by_level_.size(); ++k) {
    const Var v = by_level_[k];
    const std::uint32_t bit = v / 2;
    if (f > 1 && game_.store.var_of(f) == v) {
      const Edge low = game_.store.low_of(f), high = game_.store.high_of(f);
      if (high == bdd_false) {
        f = low;
        continue;
      }
      if (low != bdd_false && !follow<Words>(low, k + 1, valuation))
        return false;
      f = high;
    } else if (is_input_[bit] || all_outputs_) {
      if (!follow<Words>(f, k + 1, valuation))
        return false;
    } else {
      continue; // 0 is the least
    }
    set_bit(valuation.data(), bit);
  }
  return keep(valuation.data());
}

// The same for any width, in place.
bool Successors::follow_wide(Edge f, std::size_t k) {
  if (f == bdd_false)
    return true;
  if (k == by_level_.size())
    return keep(valuation_.data());
  const Var v = by_level_[k];
  const std::uint32_t bit = v / 2;
  const bool branches = f > 1 && game_.store.var_of(f) == v;
  if (!follow_wide(branches ? game_.store.low_of(f) : f, k + 1))
    return false;
  if (!branches && !is_input_[bit] && !all_outputs_)
    return true; // 0 is the least
  set_bit(valuation_.data(), bit);
  const bool complete = follow_wide(branches ? game_.store.high_of(f) : f, k + 1);
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
