// See certificate/moves/completions.hpp.

#include "certificate/moves/completions.hpp"

#include "certificate/moves/backtracking.hpp"

#include <algorithm>
#include <set>

namespace slugs {

Completions::Completions(const Specification &specification, std::vector<Section> sections,
                         std::vector<OpenVariable> open, std::uint64_t limit, const Budget &budget)
    : remainders_(specification, std::move(open), sections), sections_(std::move(sections)), limit_(limit),
      budget_(budget) {}

const Completions::Answer &Completions::answer(unsigned lane) {
  Conjunction all;
  for (const Section section : sections_) {
    const std::optional<Conjunction> part = remainders_.remainder(section, lane);
    if (!part)
      return none_;
    all.insert(all.end(), part->begin(), part->end());
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  std::unique_ptr<Answer> &answer = answers_[all];
  if (!answer)
    answer = compose(all);
  return *answer;
}

std::unique_ptr<Completions::Answer> Completions::compose(const Conjunction &remainder) {
  const std::vector<OpenVariable> &open = remainders_.open();
  // Formulas that share a variable go together: each position points to a
  // representative of its class (union-find with path halving).
  std::vector<std::uint32_t> parent(open.size());
  for (std::uint32_t i = 0; i < parent.size(); ++i)
    parent[i] = i;
  const auto find = [&](std::uint32_t i) {
    while (parent[i] != i)
      i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<bool> constrained(open.size());
  for (const FormulaId formula : remainder)
    for (const std::uint32_t position : remainders_.support(formula)) {
      parent[find(position)] = find(remainders_.support(formula).front());
      constrained[position] = true;
    }
  std::map<std::uint32_t, Conjunction> parts;
  for (const FormulaId formula : remainder)
    parts[find(remainders_.support(formula).front())].push_back(formula);

  auto answer = std::make_unique<Answer>();
  answer->count = 1;
  const auto multiply = [&](std::uint64_t by) {
    answer->count = by != 0 && answer->count > (limit_ + 1) / by ? limit_ + 1 : answer->count * by;
  };
  for (const auto &part : parts)
    answer->factors.push_back(&component(part.second));
  for (std::uint32_t i = 0; i < open.size(); ++i)
    if (!constrained[i])
      answer->unconstrained.push_back(i);
  for (const Component *factor : answer->factors)
    multiply(factor->solutions.size());
  for (std::size_t i = 0; i < answer->unconstrained.size(); ++i)
    multiply(2);
  // A component without solutions excludes all completions, whatever the others
  // allow.
  for (const Component *factor : answer->factors)
    if (factor->solutions.empty())
      answer->count = 0;
  return answer;
}

const Completions::Component &Completions::component(const Conjunction &remainder) {
  std::unique_ptr<Component> &known = components_[remainder];
  if (known)
    return *known;
  auto fresh = std::make_unique<Component>();
  std::set<std::uint32_t> positions;
  for (const FormulaId formula : remainder)
    positions.insert(remainders_.support(formula).begin(), remainders_.support(formula).end());
  fresh->positions.assign(positions.begin(), positions.end());
  std::vector<OpenVariable> variables;
  for (const std::uint32_t position : fresh->positions)
    variables.push_back(remainders_.open()[position]);
  fresh->solutions =
      solutions(remainders_.pool(), remainder, variables, remainders_.variable_count(), limit_ + 1, budget_);
  known = std::move(fresh);
  return *known;
}

void Completions::enumerate(const Answer &answer,
                            const std::function<bool(const std::vector<bool> &)> &visit) const {
  if (answer.count == 0)
    return;
  // An odometer: one digit for each factor and each unconstrained variable.
  std::vector<std::size_t> digit(answer.factors.size() + answer.unconstrained.size(), 0);
  std::vector<bool> values(remainders_.open().size());
  while (true) {
    for (std::size_t i = 0; i < digit.size(); ++i)
      if (i < answer.factors.size()) {
        const Component &factor = *answer.factors[i];
        for (std::size_t k = 0; k < factor.positions.size(); ++k)
          values[factor.positions[k]] = factor.solutions[digit[i]][k];
      } else {
        values[answer.unconstrained[i - answer.factors.size()]] = digit[i] == 1;
      }
    if (!visit(values))
      return;
    std::size_t i = 0;
    for (; i < digit.size(); ++i) {
      const std::size_t radix = i < answer.factors.size() ? answer.factors[i]->solutions.size() : 2;
      if (++digit[i] < radix)
        break;
      digit[i] = 0;
    }
    if (i == digit.size())
      return;
  }
}

} // namespace slugs
