// Advance the rank once per state if possible, else per successor.

#include "strategy/states/ranks.hpp"

namespace slugs {

Ranks::Ranks(BddStore &store, StateCofactor &cofactor, const std::vector<Bdd> &conditions)
    : edges_(store.edges()), cofactor_(cofactor), conditions_(conditions), cofactors_(conditions.size()) {}

Ranks::Step Ranks::from(const Word *state, std::uint32_t rank) {
  std::uint32_t result = rank;
  do {
    const Edge condition = cofactor_(conditions_[result].edge(), state);
    if (condition == bdd_false)
      return {result, 0};
    if (condition != bdd_true) {
      for (std::size_t i = 0; i < conditions_.size(); ++i)
        cofactors_[i] = cofactor_(conditions_[i].edge(), state);
      const auto number = static_cast<std::uint32_t>(signatures_.size() + 1);
      return {rank, signatures_.try_emplace(cofactors_, number).first->second};
    }
    result = static_cast<std::uint32_t>((result + 1) % conditions_.size());
  } while (result != rank);
  return {result, 0};
}

std::uint32_t Ranks::advance(const Step &step, const Word *next) const {
  if (!step.signature)
    return step.rank;
  std::uint32_t result = step.rank;
  do {
    Edge e = cofactors_[result];
    while (e > 1)
      e = get_bit(next, edges_.var_of(e) / 2) ? edges_.high_of(e) : edges_.low_of(e);
    if (e == bdd_false)
      break;
    result = static_cast<std::uint32_t>((result + 1) % conditions_.size());
  } while (result != step.rank);
  return result;
}

} // namespace slugs
