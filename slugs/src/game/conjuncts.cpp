#include "game/conjuncts.hpp"

#include "core/hash.hpp"

#include <algorithm>

namespace slugs {

namespace {

// What has been met. Most formulas are small and there are very many, so a set must
// cost next to nothing to begin with: open addressing, and no memory for each element.
class Met {
public:
  // Whether it is new.
  bool insert(std::uint64_t id) {
    if (2 * (count_ + 1) > slots_.size())
      grow();
    std::uint64_t &slot = slots_[place_of(id)];
    if (slot != empty)
      return false;
    slot = id;
    ++count_;
    return true;
  }

private:
  static constexpr std::uint64_t empty = static_cast<std::uint64_t>(-1);

  // Where it is, or the empty place where it belongs.
  std::size_t place_of(std::uint64_t id) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = static_cast<std::size_t>((id * golden_multiplier) >> 32) & mask;
    while (slots_[at] != empty && slots_[at] != id)
      at = (at + 1) & mask;
    return at;
  }
  void grow() {
    const std::vector<std::uint64_t> before = std::move(slots_);
    slots_.assign(2 * before.size(), empty);
    for (const std::uint64_t id : before)
      if (id != empty)
        slots_[place_of(id)] = id;
  }

  std::vector<std::uint64_t> slots_ = std::vector<std::uint64_t>(32, empty);
  std::size_t count_ = 0;
};

} // namespace

std::vector<FormulaId> conjuncts(FormulaPool &formulas, FormulaId formula) {
  std::vector<FormulaId> result;
  Met seen;
  std::vector<std::pair<FormulaId, bool>> todo{{formula, false}};
  while (!todo.empty()) {
    const auto [f, negative] = todo.back();
    todo.pop_back();
    if (!seen.insert(std::uint64_t{f} << 1 | (negative ? 1 : 0)))
      continue;
    const FormulaNode node = formulas[f];
    if (node.op == Op::Not) {
      todo.emplace_back(node.left, !negative);
    } else if (node.op == (negative ? Op::Or : Op::And)) {
      todo.emplace_back(node.right, negative);
      todo.emplace_back(node.left, negative);
    } else if (f != formulas.constant(!negative)) {
      result.push_back(negative ? formulas.negation(f) : f);
    }
  }
  return result;
}

std::vector<FormulaId> conjuncts(const Specification &specification, FormulaPool &formulas, Section section) {
  std::vector<FormulaId> parts;
  Met known;
  for (const Constraint &constraint : specification[section])
    for (const FormulaId f : conjuncts(formulas, constraint.formula))
      if (known.insert(f))
        parts.push_back(f);
  return parts;
}

bool mentions(const FormulaPool &formulas, FormulaId formula,
              const std::function<bool(const FormulaNode &)> &asked) {
  Met seen;
  std::vector<FormulaId> todo{formula};
  while (!todo.empty()) {
    const FormulaNode &node = formulas[todo.back()];
    todo.pop_back();
    if (node.op == Op::Variable) {
      if (asked(node))
        return true;
      continue;
    }
    if (node.op == Op::False || node.op == Op::True)
      continue;
    if (seen.insert(node.left))
      todo.push_back(node.left);
    if (node.op != Op::Not && seen.insert(node.right))
      todo.push_back(node.right);
  }
  return false;
}

std::vector<std::uint32_t> variables_of(const FormulaPool &formulas, FormulaId formula) {
  std::vector<std::uint32_t> result;
  mentions(formulas, formula, [&](const FormulaNode &variable) {
    result.push_back(variable.left);
    return false;
  });
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

} // namespace slugs
