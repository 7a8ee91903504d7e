// See certificate/moves/remainders.hpp.

#include "certificate/moves/remainders.hpp"

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

Remainders::Remainders(const Specification &specification, std::vector<OpenVariable> open,
                       const std::vector<Section> &sections)
    : specification_(specification), pool_(specification.formulas), open_(std::move(open)),
      position_(specification.variables.size(), {not_open, not_open}),
      evaluation_(pool_, formulas_of(specification, sections)), slots_(pool_.size()),
      only_open_(pool_.size()), rewritten_(pool_.size()), stamp_(pool_.size(), 0) {
  pool_.remember_all(); // queries repeat the same remainders
  for (std::uint32_t i = 0; i < open_.size(); ++i)
    position_[open_[i].index][open_[i].next ? 1 : 0] = i;
  for (std::uint32_t slot = 0; slot < evaluation_.needed().size(); ++slot)
    slots_[evaluation_.needed()[slot]] = slot;
  for (FormulaId id = 0; id < pool_.size(); ++id) {
    const FormulaNode node = pool_[id];
    if (node.op == Op::Variable)
      only_open_[id] = position_[node.left][node.right] != not_open;
    else
      only_open_[id] =
          (node.op < Op::Not || only_open_[node.left]) && (node.op <= Op::Not || only_open_[node.right]);
  }
}

void Remainders::load(Assignment assignment) {
  for (const OpenVariable &variable : open_)
    (variable.next ? assignment.next : assignment.current)[variable.index] = Truth{};
  evaluation_.run(assignment);
  ++now_;
}

std::optional<Remainders::Conjunction> Remainders::remainder(Section section, unsigned lane) {
  const LaneBits bit = LaneBits{1} << lane;
  Conjunction result;
  ++now_;
  for (const Constraint &constraint : specification_[section]) {
    const Truth &truth = evaluation_.at(slots_[constraint.formula]);
    if (truth.no & bit)
      return std::nullopt;
    if (truth.yes & bit)
      continue;
    const FormulaId formula = rewrite(constraint.formula, lane);
    if (formula == pool_.constant(false))
      return std::nullopt;
    if (formula != pool_.constant(true))
      result.push_back(formula);
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

template <class Settle> FormulaId Remainders::rebuild(FormulaId root, Settle settle) {
  std::vector<FormulaId> open = {root};
  while (!open.empty()) {
    const FormulaId id = open.back();
    if (settle(id)) {
      open.pop_back();
      continue;
    }
    const FormulaNode node = pool_[id]; // an operator
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
                                          : pool_.exclusive_or(a, b);
    stamp_[id] = now_;
    open.pop_back();
  }
  return rewritten_[root];
}

// Replaces the formulas that the lane decides by constants.  Formulas over open
// variables are unchanged.
FormulaId Remainders::rewrite(FormulaId root, unsigned lane) {
  return rebuild(root, [&](FormulaId id) {
    if (stamp_[id] == now_)
      return true;
    const Truth &truth = evaluation_.at(slots_[id]);
    const LaneBits bit = LaneBits{1} << lane;
    if (truth.yes & bit)
      rewritten_[id] = pool_.constant(true);
    else if (truth.no & bit)
      rewritten_[id] = pool_.constant(false);
    else if (only_open_[id])
      rewritten_[id] = id;
    else
      return false; // undecided and mixed: an operator
    stamp_[id] = now_;
    return true;
  });
}

FormulaId Remainders::substitute(FormulaId formula, const std::vector<std::optional<bool>> &values) {
  // The pool may have grown since the last time; operands have smaller ids.
  if (rewritten_.size() < pool_.size()) {
    rewritten_.resize(pool_.size());
    stamp_.resize(pool_.size(), 0);
  }
  ++now_;
  return rebuild(formula, [&](FormulaId id) {
    if (stamp_[id] == now_)
      return true;
    const FormulaNode node = pool_[id];
    if (node.op >= Op::Not)
      return false;
    rewritten_[id] = id;
    if (node.op == Op::Variable)
      if (const std::optional<bool> value = values[position_[node.left][node.right]])
        rewritten_[id] = pool_.constant(*value);
    stamp_[id] = now_;
    return true;
  });
}

const std::vector<std::uint32_t> &Remainders::support(FormulaId formula) {
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

} // namespace slugs
