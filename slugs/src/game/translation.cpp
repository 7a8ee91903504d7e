#include "game/translation.hpp"

#include <algorithm>
#include <cassert>

namespace slugs {

Translation::Translation(BddStore &store, const FormulaPool &formulas)
    : store_(store), formulas_(formulas), pacer_(store.account().budget()), uses_(formulas.size(), 0),
      place_(formulas.size(), 0) {}

Bdd Translation::take(FormulaId id) {
  const FormulaNode &node = formulas_[id];
  switch (node.op) {
  case Op::False:
    return store_.constant(false);
  case Op::True:
    return store_.constant(true);
  case Op::Variable:
    return store_.variable(node.right ? next_var(node.left) : current_var(node.left));
  default:
    break;
  }
  assert(uses_[id] > 0);
  Bdd &value = values_[place_[id]];
  const Bdd result = value;
  if (--uses_[id] == 0) {
    value = Bdd();
    free_places_.push_back(place_[id]);
  }
  return result;
}

void Translation::keep(FormulaId id, const Bdd &value) {
  if (free_places_.empty()) {
    free_places_.push_back(static_cast<std::uint32_t>(values_.size()));
    values_.emplace_back();
  }
  place_[id] = free_places_.back();
  free_places_.pop_back();
  values_[place_[id]] = value;
}

// Sort operators after their operands.  If they are a large share of their id range,
// scan the range instead of sorting.
void Translation::bring_into_order(std::vector<FormulaId> &needed) {
  constexpr std::size_t share = 4;
  if (needed.empty())
    return;
  const auto [low, high] = std::minmax_element(needed.begin(), needed.end());
  const FormulaId first = *low, last = *high;
  if ((last - first) / share > needed.size()) {
    std::sort(needed.begin(), needed.end());
    return;
  }
  needed.clear();
  for (FormulaId id = first; id <= last; ++id) {
    pacer_.step();
    if (uses_[id] > 0)
      needed.push_back(id);
  }
}

Bdd Translation::operator()(FormulaId root) {
  std::vector<FormulaId> needed;
  const auto use = [&](FormulaId id) {
    if (is_operator(id) && ++uses_[id] == 1)
      needed.push_back(id);
  };
  use(root);
  for (std::size_t i = 0; i < needed.size(); ++i) {
    pacer_.step();
    const FormulaNode &node = formulas_[needed[i]];
    use(node.left);
    if (node.op != Op::Not)
      use(node.right);
  }
  bring_into_order(needed);
  for (const FormulaId id : needed) {
    pacer_.step();
    const FormulaNode &node = formulas_[id];
    const Bdd left = take(node.left);
    keep(id, node.op == Op::Not   ? !left
             : node.op == Op::And ? left & take(node.right)
             : node.op == Op::Or  ? left | take(node.right)
                                  : left ^ take(node.right));
  }
  return take(root);
}

} // namespace slugs
