// FORCE (Aloul, Markov and Sakallah 2003): each constraint pulls its variables
// to their common centre of gravity, until the total span of the constraints
// stops falling.  It is cheap, and sifting improves the result later.  Sifting the
// declaration order instead would require building the diagrams in that order.

#include "game/analysis/order.hpp"

#include <algorithm>
#include <numeric>

namespace slugs {

namespace {

// The variables of each conjunct that has at least two, stored contiguously.
class HyperEdges {
public:
  HyperEdges(const Conjuncts &conjuncts, BudgetPacer &pacer) {
    for (std::size_t i = 0; i < section_count; ++i) {
      const Section section = static_cast<Section>(i);
      for (const std::uint32_t occurrence : conjuncts.occurrences(section)) {
        const std::size_t before = pins_.size();
        for (const Read read : conjuncts.reads(conjuncts[section][occurrence])) {
          pacer.step();
          pins_.push_back(read.variable);
        }
        const auto first = pins_.begin() + static_cast<std::ptrdiff_t>(before);
        std::sort(first, pins_.end());
        pins_.erase(std::unique(first, pins_.end()), pins_.end());
        if (pins_.size() > before + 1)
          ends_.push_back(pins_.size());
        else
          pins_.resize(before);
      }
    }
  }

  std::size_t pins() const { return pins_.size(); }
  // Call use(begin, end) for each hyperedge.
  template <class Use> void for_each(Use use) const {
    const std::uint32_t *begin = pins_.data();
    for (const std::size_t end : ends_) {
      use(begin, pins_.data() + end);
      begin = pins_.data() + end;
    }
  }

private:
  std::vector<std::uint32_t> pins_;
  std::vector<std::size_t> ends_;
};

std::uint64_t total_span(const HyperEdges &edges, const std::vector<double> &position, BudgetPacer &pacer) {
  double span = 0;
  edges.for_each([&](const std::uint32_t *v, const std::uint32_t *end) {
    pacer.step();
    double low = position[*v], high = low;
    for (++v; v != end; ++v) {
      low = std::min(low, position[*v]);
      high = std::max(high, position[*v]);
    }
    span += high - low;
  });
  return static_cast<std::uint64_t>(span);
}

} // namespace

std::vector<std::uint32_t> force_order(std::size_t n, const Conjuncts &conjuncts, const Budget &budget) {
  BudgetPacer pacer(budget);
  const HyperEdges edges(conjuncts, pacer);

  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0u);
  std::vector<double> position(n);
  std::iota(position.begin(), position.end(), 0.0);
  std::vector<std::uint32_t> best = order;
  std::uint64_t best_span = total_span(edges, position, pacer);
  constexpr int most_rounds = 60, max_stale_rounds = 5;
  // A round visits all pins, so millions of constraints allow few rounds.
  constexpr std::size_t most_pins = std::size_t{1} << 26;
  std::size_t pins = 0;
  for (int round = 0, stale = 0; round < most_rounds && stale < max_stale_rounds && pins < most_pins;
       ++round) {
    budget.check();
    pins += edges.pins();
    std::vector<double> pull(n, 0.0);
    std::vector<std::uint32_t> degree(n, 0);
    edges.for_each([&](const std::uint32_t *begin, const std::uint32_t *end) {
      pacer.step();
      double centre = 0;
      for (const std::uint32_t *v = begin; v != end; ++v)
        centre += position[*v];
      centre /= static_cast<double>(end - begin);
      for (const std::uint32_t *v = begin; v != end; ++v) {
        pull[*v] += centre;
        ++degree[*v];
      }
    });
    for (std::uint32_t v = 0; v < n; ++v)
      if (degree[v])
        position[v] = pull[v] / degree[v];
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return position[a] < position[b]; });
    for (std::uint32_t k = 0; k < n; ++k)
      position[order[k]] = k;
    const std::uint64_t span = total_span(edges, position, pacer);
    ++stale;
    if (span < best_span) {
      best_span = span;
      best = order;
      stale = 0;
    }
  }
  return best;
}

std::vector<std::uint32_t> hubs_first(std::vector<std::uint32_t> order, const Conjuncts &conjuncts) {
  constexpr std::size_t many = 8;
  std::vector<std::size_t> degree(order.size(), 0);
  for (std::size_t i = 0; i < section_count; ++i) {
    const Section section = static_cast<Section>(i);
    for (const std::uint32_t occurrence : conjuncts.occurrences(section))
      for (const Read read : conjuncts.reads(conjuncts[section][occurrence]))
        ++degree[read.variable];
  }
  std::vector<std::size_t> sorted = degree;
  const auto median = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), median, sorted.end());
  const std::size_t most = sorted.empty() ? 0 : many * (*median + 1);
  std::stable_partition(order.begin(), order.end(), [&](std::uint32_t v) { return degree[v] > most; });
  return order;
}

std::vector<std::uint32_t> start_order(std::size_t variables, const Conjuncts &conjuncts,
                                       const std::vector<IndependentPart> &parts, const Budget &budget) {
  const std::vector<std::uint32_t> order = hubs_first(force_order(variables, conjuncts, budget), conjuncts);
  if (parts.empty())
    return order;
  // Parts in the order of their first variables, with the shared variables second.
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
