#include "game/conjuncts.hpp"

#include <algorithm>
#include <unordered_set>

namespace slugs {

std::vector<FormulaId> conjuncts(FormulaPool &formulas, FormulaId formula) {
  std::vector<FormulaId> result;
  std::unordered_set<std::uint64_t> seen;
  std::vector<std::pair<FormulaId, bool>> todo{{formula, false}};
  while (!todo.empty()) {
    const auto [f, negative] = todo.back();
    todo.pop_back();
    if (!seen.insert(std::uint64_t{f} << 1 | (negative ? 1 : 0)).second)
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
  std::unordered_set<FormulaId> known;
  for (const Constraint &constraint : specification[section])
    for (const FormulaId f : conjuncts(formulas, constraint.formula))
      if (known.insert(f).second)
        parts.push_back(f);
  return parts;
}

bool mentions(const FormulaPool &formulas, FormulaId formula,
              const std::function<bool(const FormulaNode &)> &asked) {
  std::unordered_set<FormulaId> seen{formula};
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
    if (seen.insert(node.left).second)
      todo.push_back(node.left);
    if (node.op != Op::Not && seen.insert(node.right).second)
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
