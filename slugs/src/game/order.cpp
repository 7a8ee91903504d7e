// FORCE (Aloul, Markov and Sakallah 2003): every constraint pulls its variables
// to their common centre of gravity, until the total span of the constraints
// stops falling.  It costs next to nothing, and sifting later repairs what it
// gets wrong; sifting from the order of declaration alone would first have to
// build the diagrams in that order.

#include "game/order.hpp"

#include "game/conjuncts.hpp"
#include "game/independent_parts.hpp"

#include <algorithm>
#include <numeric>

namespace slugs {

namespace {

using HyperEdge = std::vector<std::uint32_t>;

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

std::vector<std::uint32_t> force_order(const Specification &specification, const Budget &budget) {
  const std::size_t n = specification.variables.size();
  FormulaPool formulas = specification.formulas;
  BudgetPacer pacer(budget);
  std::vector<HyperEdge> edges;
  for (const auto &section : specification.constraints)
    for (const Constraint &constraint : section)
      for (const FormulaId f : conjuncts(formulas, constraint.formula)) {
        pacer.step();
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
    budget.check();
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

std::vector<std::uint32_t> start_order(const Specification &specification, const Budget &budget) {
  const std::vector<std::uint32_t> order = force_order(specification, budget);
  FormulaPool formulas = specification.formulas;
  const std::vector<IndependentPart> parts = independent_parts(specification, formulas, budget).parts;
  if (parts.empty())
    return order;
  // Parts in the order of their first variables; the rest, which is nobody's own,
  // comes second.
  std::vector<std::size_t> part_of(order.size(), parts.size());
  for (std::size_t k = 0; k < parts.size(); ++k)
    for (const std::uint32_t v : parts[k].own)
      part_of[v] = k;
  std::vector<std::size_t> place(parts.size() + 1, 0);
  std::size_t places = 0;
  for (const std::uint32_t v : order)
    if (part_of[v] < parts.size() && place[part_of[v]] == 0)
      place[part_of[v]] = ++places == 1 ? 1 : places + 1;
  place.back() = 2;
  std::vector<std::uint32_t> result = order;
  std::stable_sort(result.begin(), result.end(),
                   [&](std::uint32_t v, std::uint32_t w) { return place[part_of[v]] < place[part_of[w]]; });
  return result;
}

} // namespace slugs
