// Steps (1) and (2): what a query leaves to be solved.  Step (3) is in
// check_backtracking.cpp.

#include "check_completions.hpp"

#include "check_backtracking.hpp"

#include <algorithm>
#include <set>

namespace slugs {

namespace {

constexpr std::uint32_t not_open = static_cast<std::uint32_t>(-1);

std::vector<FormulaId> formulas_of(const Specification &specification, const std::vector<Section> &sections) {
  std::vector<FormulaId> formulas;
  for (const Section section : sections)
    for (const Constraint &constraint : specification[section])
      formulas.push_back(constraint.formula);
  return formulas;
}

} // namespace

Completions::Completions(const Specification &specification, const std::vector<Section> &sections,
                         std::vector<OpenVariable> open, std::uint64_t limit, const Budget &budget)
    : pool_(specification.formulas), roots_(formulas_of(specification, sections)), open_(std::move(open)),
      limit_(limit), budget_(budget), position_(specification.variables.size(), {not_open, not_open}),
      evaluation_(pool_, roots_), rewritten_(pool_.size()), stamp_(pool_.size(), 0) {
  slots_.resize(pool_.size());
  for (std::uint32_t slot = 0; slot < evaluation_.needed().size(); ++slot)
    slots_[evaluation_.needed()[slot]] = slot;
  for (std::uint32_t i = 0; i < open_.size(); ++i)
    position_[open_[i].index][open_[i].next ? 1 : 0] = i;
  only_open_.resize(pool_.size());
  for (FormulaId id = 0; id < pool_.size(); ++id) {
    const FormulaNode node = pool_[id];
    if (node.op == Op::Variable)
      only_open_[id] = position_[node.left][node.right] != not_open;
    else
      only_open_[id] =
          (node.op < Op::Not || only_open_[node.left]) && (node.op <= Op::Not || only_open_[node.right]);
  }
}

void Completions::load(Assignment assignment) {
  for (const OpenVariable &variable : open_)
    (variable.next ? assignment.next : assignment.current)[variable.index] = Truth{};
  evaluation_.run(assignment);
}

const Completions::Answer &Completions::answer(unsigned lane) {
  const std::optional<Remainder> remainder = this->remainder(lane);
  if (!remainder)
    return none_;
  std::unique_ptr<Answer> &answer = answers_[*remainder];
  if (!answer)
    answer = compose(*remainder);
  return *answer;
}

// The undecided constraints over open variables; nothing if one is violated.
std::optional<Completions::Remainder> Completions::remainder(unsigned lane) {
  const Word bit = Word{1} << lane;
  Remainder result;
  ++now_;
  for (const FormulaId root : roots_) {
    const Truth &truth = evaluation_.at(slots_[root]);
    if (truth.no & bit)
      return std::nullopt;
    if (truth.yes & bit)
      continue;
    const FormulaId formula = rewrite(root, lane);
    if (formula == pool_.constant(false))
      return std::nullopt;
    if (formula != pool_.constant(true))
      result.push_back(formula);
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

// Replaces what the lane decides by constants.  Sub-formulas over open
// variables stay as they are.
FormulaId Completions::rewrite(FormulaId root, unsigned lane) {
  const auto settle = [&](FormulaId id) {
    if (stamp_[id] == now_)
      return true;
    const Truth &truth = evaluation_.at(slots_[id]);
    const Word bit = Word{1} << lane;
    if (truth.yes & bit)
      rewritten_[id] = pool_.constant(true);
    else if (truth.no & bit)
      rewritten_[id] = pool_.constant(false);
    else if (only_open_[id])
      rewritten_[id] = id;
    else
      return false;
    stamp_[id] = now_;
    return true;
  };
  std::vector<FormulaId> open = {root};
  while (!open.empty()) {
    const FormulaId id = open.back();
    if (settle(id)) {
      open.pop_back();
      continue;
    }
    const FormulaNode node = pool_[id]; // undecided and mixed: an operator
    const bool left = settle(node.left);
    const bool right = node.op == Op::Not || settle(node.right);
    if (!left)
      open.push_back(node.left);
    if (!right)
      open.push_back(node.right);
    if (!left || !right)
      continue;
    const FormulaId a = rewritten_[node.left];
    const FormulaId b = node.op == Op::Not ? a : rewritten_[node.right];
    rewritten_[id] = node.op == Op::Not   ? pool_.negation(a)
                     : node.op == Op::And ? pool_.conjunction(a, b)
                     : node.op == Op::Or  ? pool_.disjunction(a, b)
                                          : pool_.exclusive(a, b);
    stamp_[id] = now_;
    open.pop_back();
  }
  return rewritten_[root];
}

// Positions of the open variables of a remainder's formula, sorted.
const std::vector<std::uint32_t> &Completions::support(FormulaId formula) {
  const auto [entry, fresh] = supports_.try_emplace(formula);
  if (fresh) {
    std::set<FormulaId> seen = {formula};
    std::vector<FormulaId> open = {formula};
    while (!open.empty()) {
      const FormulaNode node = pool_[open.back()];
      open.pop_back();
      if (node.op == Op::Variable)
        entry->second.push_back(position_[node.left][node.right]);
      if (node.op >= Op::Not && seen.insert(node.left).second)
        open.push_back(node.left);
      if (node.op > Op::Not && seen.insert(node.right).second)
        open.push_back(node.right);
    }
    std::sort(entry->second.begin(), entry->second.end());
  }
  return entry->second;
}

std::unique_ptr<Completions::Answer> Completions::compose(const Remainder &remainder) {
  // Formulas that share a variable go together: each position points to a
  // representative of its class (union-find with path halving).
  std::vector<std::uint32_t> parent(open_.size());
  for (std::uint32_t i = 0; i < parent.size(); ++i)
    parent[i] = i;
  const auto find = [&](std::uint32_t i) {
    while (parent[i] != i)
      i = parent[i] = parent[parent[i]];
    return i;
  };
  std::vector<bool> constrained(open_.size());
  for (const FormulaId formula : remainder)
    for (const std::uint32_t position : support(formula)) {
      parent[find(position)] = find(support(formula).front());
      constrained[position] = true;
    }
  std::map<std::uint32_t, Remainder> parts;
  for (const FormulaId formula : remainder)
    parts[find(support(formula).front())].push_back(formula);

  auto answer = std::make_unique<Answer>();
  answer->count = 1;
  const auto multiply = [&](std::uint64_t by) {
    answer->count = by != 0 && answer->count > (limit_ + 1) / by ? limit_ + 1 : answer->count * by;
  };
  for (const auto &part : parts)
    answer->factors.push_back(&component(part.second));
  for (std::uint32_t i = 0; i < open_.size(); ++i)
    if (!constrained[i])
      answer->unconstrained.push_back(i);
  for (const Component *factor : answer->factors)
    multiply(factor->solutions.size());
  for (std::size_t i = 0; i < answer->unconstrained.size(); ++i)
    multiply(2);
  // An impossible component outweighs any number of choices elsewhere.
  for (const Component *factor : answer->factors)
    if (factor->solutions.empty())
      answer->count = 0;
  return answer;
}

const Completions::Component &Completions::component(const Remainder &remainder) {
  std::unique_ptr<Component> &known = components_[remainder];
  if (known)
    return *known;
  auto fresh = std::make_unique<Component>();
  std::set<std::uint32_t> positions;
  for (const FormulaId formula : remainder)
    positions.insert(support(formula).begin(), support(formula).end());
  fresh->positions.assign(positions.begin(), positions.end());
  std::vector<OpenVariable> variables;
  for (const std::uint32_t position : fresh->positions)
    variables.push_back(open_[position]);
  fresh->solutions = solutions(pool_, remainder, variables, position_.size(), limit_ + 1, budget_);
  known = std::move(fresh);
  return *known;
}

void Completions::enumerate(const Answer &answer,
                            const std::function<bool(const std::vector<bool> &)> &visit) const {
  if (answer.count == 0)
    return;
  // An odometer: one wheel for each factor and each unconstrained variable.
  std::vector<std::size_t> wheel(answer.factors.size() + answer.unconstrained.size(), 0);
  std::vector<bool> values(open_.size());
  while (true) {
    for (std::size_t i = 0; i < wheel.size(); ++i)
      if (i < answer.factors.size()) {
        const Component &factor = *answer.factors[i];
        for (std::size_t k = 0; k < factor.positions.size(); ++k)
          values[factor.positions[k]] = factor.solutions[wheel[i]][k];
      } else {
        values[answer.unconstrained[i - answer.factors.size()]] = wheel[i] == 1;
      }
    if (!visit(values))
      return;
    std::size_t i = 0;
    for (; i < wheel.size(); ++i) {
      const std::size_t teeth = i < answer.factors.size() ? answer.factors[i]->solutions.size() : 2;
      if (++wheel[i] < teeth)
        break;
      wheel[i] = 0;
    }
    if (i == wheel.size())
      return;
  }
}

} // namespace slugs
