#include "game/reached_goals.hpp"

namespace slugs {

void ReachedGoals::add(const Bdd &last) {
  if (!last.is_false())
    goals_.push_back({FrozenBdd(store_, last), store_.some_valuation(last)});
}

// Check the latest goal first: goals near each other are often listed consecutively.
bool ReachedGoals::covered(const Bdd &open) {
  constexpr std::uint64_t share = 8;
  for (std::size_t i = goals_.size(); i-- > 0;) {
    Goal &goal = goals_[i];
    if (store_.evaluate(open.edge(), goal.uncovered))
      continue;
    const std::uint64_t work = store_.work();
    if (check_work_ > (work - work_at_start_) / share)
      return false;
    const Bdd uncovered = goal.last.thaw(store_) & open;
    check_work_ += store_.work() - work + goal.last.size();
    if (uncovered.is_false())
      return true;
    goal.uncovered = store_.some_valuation(uncovered);
  }
  return false;
}

} // namespace slugs
