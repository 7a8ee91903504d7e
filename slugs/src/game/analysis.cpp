// Conjuncts by traversal, independent parts by union-find, the initial order by FORCE.

#include "game/analysis.hpp"

#include <algorithm>
#include <cassert>
#include <map>
#include <numeric>
#include <utility>

namespace slugs {

namespace {

// Set of small numbers; clear() takes time proportional to its size, not its range.
class MarkedNumbers {
public:
  explicit MarkedNumbers(std::size_t most) : marked_(most, false) {}
  // Insert a number and return whether it is new.
  bool insert(std::size_t number) {
    assert(number < marked_.size());
    if (marked_[number])
      return false;
    marked_[number] = true;
    numbers_.push_back(static_cast<std::uint32_t>(number));
    return true;
  }
  void clear() {
    for (const std::uint32_t number : numbers_)
      marked_[number] = false;
    assert(std::none_of(numbers_.begin(), numbers_.end(), [&](std::uint32_t n) { return marked_[n]; }));
    numbers_.clear();
  }

private:
  std::vector<bool> marked_;
  std::vector<std::uint32_t> numbers_;
};

std::size_t signed_number(FormulaId formula, bool negative) {
  return 2 * std::size_t{formula} + (negative ? 1 : 0);
}

// Traversal of formulas from their roots, without recursion.
class Visit {
public:
  Visit(const FormulaPool &formulas, const Budget &budget)
      : formulas_(formulas), pacer_(budget), seen_(2 * formulas.size()) {}

  template <class Found> void conjuncts(FormulaId formula, Found found) {
    std::vector<std::pair<FormulaId, bool>> todo{{formula, false}};
    while (!todo.empty()) {
      pacer_.step();
      const auto [f, negative] = todo.back();
      todo.pop_back();
      if (!seen_.insert(signed_number(f, negative)))
        continue;
      const FormulaNode &node = formulas_[f];
      assert(node.op < Op::Not || node.left < f); // operands precede operators
      if (node.op == Op::Not) {
        todo.emplace_back(node.left, !negative);
      } else if (node.op == (negative ? Op::Or : Op::And)) {
        todo.emplace_back(node.right, negative);
        todo.emplace_back(node.left, negative);
      } else if (f != formulas_.constant(!negative)) {
        found(f, negative);
      }
    }
    seen_.clear();
  }

  void reads(FormulaId formula, std::vector<Read> &reads) {
    std::vector<FormulaId> todo{formula};
    const auto visit = [&](FormulaId f) {
      if (seen_.insert(f))
        todo.push_back(f);
    };
    while (!todo.empty()) {
      pacer_.step();
      const FormulaNode &node = formulas_[todo.back()];
      todo.pop_back();
      assert(node.op != Op::Variable || node.right <= 1);
      if (node.op == Op::Variable)
        reads.push_back({node.left & 0x7FFFFFFFu, node.right & 1u});
      if (node.op >= Op::Not)
        visit(node.left);
      if (node.op > Op::Not)
        visit(node.right);
    }
    seen_.clear();
  }

private:
  const FormulaPool &formulas_;
  BudgetPacer pacer_;
  MarkedNumbers seen_;
};

} // namespace

Conjuncts::Conjuncts(const Specification &specification, const Budget &budget) {
  const FormulaPool &formulas = specification.formulas;
  Visit visit(formulas, budget), below(formulas, budget);
  std::vector<std::uint32_t> known(2 * formulas.size()); // 1 + index into all_[section]; 0: none
  for (std::size_t section = 0; section < section_count; ++section) {
    std::vector<Conjunct> &all = all_[section];
    for (const Constraint &constraint : specification.constraints[section])
      visit.conjuncts(constraint.formula, [&](FormulaId f, bool negative) {
        std::uint32_t &place = known[signed_number(f, negative)];
        if (place == 0) {
          const std::size_t first = reads_.size();
          below.reads(f, reads_);
          all.push_back({f, negative, static_cast<std::uint32_t>(reads_.size() - first), first});
          place = static_cast<std::uint32_t>(all.size());
        }
        assert(place >= 1 && place <= all.size());
        occurrences_[section].push_back(place - 1);
      });
    assert(occurrences_[section].size() >= all.size());
    for (const Conjunct &conjunct : all)
      known[signed_number(conjunct.formula, conjunct.negative)] = 0;
  }
}

namespace {

// Union-find over variables (Galler and Fischer 1964).
class Groups {
public:
  explicit Groups(std::size_t n) : leader_(n) { std::iota(leader_.begin(), leader_.end(), 0u); }
  std::uint32_t of(std::uint32_t v) {
    assert(v < leader_.size());
    while (leader_[v] != v)
      v = leader_[v] = leader_[leader_[v]];
    return v;
  }
  void join(std::uint32_t v, std::uint32_t w) {
    leader_[of(v)] = of(w);
    assert(of(v) == of(w));
  }

private:
  std::vector<std::uint32_t> leader_;
};

} // namespace

Environment independent_parts(const Specification &specification, const Conjuncts &conjuncts,
                              const Budget &budget) {
  constexpr std::uint32_t none = static_cast<std::uint32_t>(-1);
  BudgetPacer pacer(budget);
  const auto is_input = [&](Read read) {
    return specification.variables[read.variable].owner == Owner::Input;
  };
  Environment environment;
  environment.shared = conjuncts[Section::EnvTrans];
  const std::size_t n = specification.variables.size();
  Groups groups(n);
  std::vector<std::uint32_t> first_next; // first next input of each constraint, or none
  for (const Conjunct &constraint : environment.shared) {
    std::uint32_t first = none;
    for (const Read read : conjuncts.reads(constraint)) {
      pacer.step();
      if (!read.next || !is_input(read))
        continue;
      if (first == none)
        first = read.variable;
      groups.join(read.variable, first);
    }
    first_next.push_back(first);
  }

  // Variables whose current values are read outside of their own group.
  std::vector<bool> read_elsewhere(n, false);
  for (std::size_t i = 0; i < environment.shared.size(); ++i)
    for (const Read read : conjuncts.reads(environment.shared[i])) {
      pacer.step();
      if (!read.next && (first_next[i] == none || groups.of(read.variable) != groups.of(first_next[i])))
        read_elsewhere[read.variable] = true;
    }
  for (const Section section : {Section::SysTrans, Section::EnvLiveness, Section::SysLiveness})
    for (const Conjunct &constraint : conjuncts[section]) {
      const Conjuncts::Reads reads = conjuncts.reads(constraint);
      const bool reads_state =
          section != Section::SysTrans ||
          std::any_of(reads.begin(), reads.end(), [&](Read read) { return read.next && !is_input(read); });
      for (const Read read : reads) {
        pacer.step();
        if (reads_state && !read.next)
          read_elsewhere[read.variable] = true;
      }
    }

  std::map<std::uint32_t, IndependentPart> parts; // keyed by group
  for (std::uint32_t v = 0; v < n; ++v)
    if (specification.variables[v].owner == Owner::Input && !read_elsewhere[v])
      parts[groups.of(v)].own.push_back(v);
  // A part with few own inputs does not justify a separate relation.
  for (auto part = parts.begin(); part != parts.end();)
    part = part->second.own.size() < budget.tuning.part_inputs ? parts.erase(part) : std::next(part);
  assert(first_next.size() == environment.shared.size());
  if (parts.size() < 2)
    return environment;
  const std::vector<Conjunct> all = std::exchange(environment.shared, {});
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto part = first_next[i] == none ? parts.end() : parts.find(groups.of(first_next[i]));
    (part == parts.end() ? environment.shared : part->second.constraints).push_back(all[i]);
  }
  for (auto &[group, part] : parts)
    environment.parts.push_back(std::move(part));
  assert(environment.parts.size() >= 2);
  for ([[maybe_unused]] const IndependentPart &part : environment.parts)
    assert(std::is_sorted(part.own.begin(), part.own.end()));
  return environment;
}

// FORCE (Aloul, Markov and Sakallah 2003): each constraint pulls its variables
// to their common centre of gravity, until the total span of the constraints
// stops falling.  It is cheap, and sifting improves the result later.  Sifting the
// declaration order instead would require building the diagrams in that order.

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
        assert(before <= pins_.size());
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
    assert(ends_.empty() || ends_.back() == pins_.size());
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

[[maybe_unused]] bool is_permutation(std::vector<std::uint32_t> order) {
  std::sort(order.begin(), order.end());
  for (std::uint32_t k = 0; k < order.size(); ++k)
    if (order[k] != k)
      return false;
  return true;
}

std::uint64_t total_span(const HyperEdges &edges, const std::vector<double> &position, BudgetPacer &pacer) {
  double span = 0;
  edges.for_each([&](const std::uint32_t *v, const std::uint32_t *end) {
    pacer.step();
    assert(v + 1 < end); // at least two pins
    double low = position[*v], high = low;
    for (++v; v != end; ++v) {
      low = std::min(low, position[*v]);
      high = std::max(high, position[*v]);
    }
    span += high - low;
  });
  assert(span >= 0);
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
  // A round visits all pins, so millions of constraints allow few rounds.
  const Tuning &t = budget.tuning;
  std::size_t pins = 0;
  for (std::size_t round = 0, stale = 0;
       round < t.force_rounds && stale < t.force_stale && pins < t.force_pins; ++round) {
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
      assert(order.size() == n);
      best_span = span;
      best = order;
      stale = 0;
    }
  }
  assert(is_permutation(best));
  return best;
}

std::vector<std::uint32_t> hubs_first(std::vector<std::uint32_t> order, const Conjuncts &conjuncts,
                                      const Tuning &tuning) {
  std::vector<std::size_t> degree(order.size(), 0);
  for (std::size_t i = 0; i < section_count; ++i) {
    const Section section = static_cast<Section>(i);
    for (const std::uint32_t occurrence : conjuncts.occurrences(section))
      for (const Read read : conjuncts.reads(conjuncts[section][occurrence]))
        ++degree[read.variable];
  }
  assert(is_permutation(order));
  std::vector<std::size_t> sorted = degree;
  const auto median = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), median, sorted.end());
  const std::size_t most = sorted.empty() ? 0 : tuning.hub_factor * (*median + 1);
  std::stable_partition(order.begin(), order.end(), [&](std::uint32_t v) { return degree[v] > most; });
  assert(is_permutation(order));
  return order;
}

std::vector<std::uint32_t> start_order(std::size_t variables, const Conjuncts &conjuncts,
                                       const std::vector<IndependentPart> &parts, const Budget &budget) {
  const std::vector<std::uint32_t> order =
      hubs_first(force_order(variables, conjuncts, budget), conjuncts, budget.tuning);
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
  assert(places == parts.size() && place.back() == 0); // each part has an input
  place.back() = 2;
  std::vector<std::uint32_t> result = order;
  std::stable_sort(result.begin(), result.end(),
                   [&](std::uint32_t v, std::uint32_t w) { return place[part_of[v]] < place[part_of[w]]; });
  assert(is_permutation(result));
  return result;
}

} // namespace slugs
