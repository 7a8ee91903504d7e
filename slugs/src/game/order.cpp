// FORCE (Aloul, Markov and Sakallah 2003): every constraint pulls its variables
// to their common centre of gravity, until the total span of the constraints
// stops falling.  It costs next to nothing, and sifting later repairs what it
// gets wrong; sifting from the order of declaration alone would first have to
// build the diagrams in that order.

#include "game/order.hpp"

#include <algorithm>
#include <numeric>
#include <unordered_set>

namespace slugs {

namespace {

using HyperEdge = std::vector<std::uint32_t>;

// Splits f (negated if `negative`) and appends its conjuncts.
void split(FormulaPool &formulas, FormulaId f, std::vector<FormulaId> &result) {
  std::unordered_set<std::uint64_t> seen;
  std::vector<std::pair<FormulaId, bool>> todo{{f, false}};
  while (!todo.empty()) {
    const auto [g, negative] = todo.back();
    todo.pop_back();
    if (!seen.insert(std::uint64_t{g} << 1 | (negative ? 1 : 0)).second)
      continue;
    const FormulaNode node = formulas[g];
    if (node.op == Op::Not) {
      todo.emplace_back(node.left, !negative);
    } else if (node.op == (negative ? Op::Or : Op::And)) {
      todo.emplace_back(node.right, negative);
      todo.emplace_back(node.left, negative);
    } else if (g != formulas.constant(!negative)) {
      result.push_back(negative ? formulas.negation(g) : g);
    }
  }
}

std::uint64_t total_span(const std::vector<HyperEdge> &edges, const std::vector<double> &position) {
  double span = 0;
  for (const HyperEdge &edge : edges) {
    const auto [low, high] =
        std::minmax_element(edge.begin(), edge.end(),
                            [&](std::uint32_t a, std::uint32_t b) { return position[a] < position[b]; });
    span += position[*high] - position[*low];
  }
  return static_cast<std::uint64_t>(span);
}

} // namespace

std::vector<FormulaId> conjuncts(FormulaPool &formulas, FormulaId formula) {
  std::vector<FormulaId> result;
  split(formulas, formula, result);
  return result;
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

std::vector<std::uint32_t> force_order(const Specification &specification) {
  const std::size_t n = specification.variables.size();
  FormulaPool formulas = specification.formulas;
  std::vector<HyperEdge> edges;
  for (const auto &section : specification.constraints)
    for (const Constraint &constraint : section)
      for (const FormulaId f : conjuncts(formulas, constraint.formula)) {
        HyperEdge edge = variables_of(formulas, f);
        if (edge.size() > 1)
          edges.push_back(std::move(edge));
      }

  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0u);
  std::vector<double> position(n);
  std::iota(position.begin(), position.end(), 0.0);
  std::vector<std::uint32_t> best = order;
  std::uint64_t best_span = total_span(edges, position);
  constexpr int most_rounds = 60, patience = 5;
  for (int round = 0, stale = 0; round < most_rounds && stale < patience; ++round) {
    std::vector<double> pull(n, 0.0);
    std::vector<std::uint32_t> degree(n, 0);
    for (const HyperEdge &edge : edges) {
      double centre = 0;
      for (const std::uint32_t v : edge)
        centre += position[v];
      centre /= static_cast<double>(edge.size());
      for (const std::uint32_t v : edge) {
        pull[v] += centre;
        ++degree[v];
      }
    }
    for (std::uint32_t v = 0; v < n; ++v)
      if (degree[v])
        position[v] = pull[v] / degree[v];
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return position[a] < position[b]; });
    for (std::uint32_t k = 0; k < n; ++k)
      position[order[k]] = k;
    const std::uint64_t span = total_span(edges, position);
    ++stale;
    if (span < best_span) {
      best_span = span;
      best = order;
      stale = 0;
    }
  }
  return best;
}

} // namespace slugs
