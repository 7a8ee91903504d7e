// See certificate/moves/evaluation.hpp.

#include "certificate/moves/evaluation.hpp"

#include <algorithm>
#include <unordered_set>

namespace slugs {

Evaluation::Evaluation(const FormulaPool &pool, const std::vector<FormulaId> &roots) {
  std::unordered_set<FormulaId> seen(roots.begin(), roots.end());
  std::vector<FormulaId> open(seen.begin(), seen.end());
  const auto need = [&](FormulaId id) {
    if (seen.insert(id).second)
      open.push_back(id);
  };
  while (!open.empty()) {
    const FormulaNode node = pool[open.back()];
    open.pop_back();
    if (node.op >= Op::Not)
      need(node.left);
    if (node.op > Op::Not)
      need(node.right);
  }
  ids_.assign(seen.begin(), seen.end());
  std::sort(ids_.begin(), ids_.end()); // operands come first
  for (const FormulaId id : ids_) {
    const FormulaNode node = pool[id];
    const auto operand = [&](FormulaId formula) { return static_cast<std::uint32_t>(slot(formula)); };
    steps_.push_back({node.op, node.op >= Op::Not ? operand(node.left) : node.left,
                      node.op > Op::Not ? operand(node.right) : node.right});
  }
  values_.resize(steps_.size());
}

std::size_t Evaluation::slot(FormulaId id) const {
  return static_cast<std::size_t>(std::lower_bound(ids_.begin(), ids_.end(), id) - ids_.begin());
}

void Evaluation::run(const Assignment &assignment) {
  for (std::size_t slot = 0; slot < steps_.size(); ++slot) {
    const Step &step = steps_[slot];
    Truth &value = values_[slot];
    switch (step.op) {
    case Op::False:
      value = known(0);
      break;
    case Op::True:
      value = known(~LaneBits{0});
      break;
    case Op::Variable:
      value = (step.right ? assignment.next : assignment.current)[step.left];
      break;
    case Op::Not:
      value = {values_[step.left].no, values_[step.left].yes};
      break;
    case Op::And: {
      const Truth &a = values_[step.left], &b = values_[step.right];
      value = {a.yes & b.yes, a.no | b.no};
      break;
    }
    case Op::Or: {
      const Truth &a = values_[step.left], &b = values_[step.right];
      value = {a.yes | b.yes, a.no & b.no};
      break;
    }
    case Op::Xor: {
      const Truth &a = values_[step.left], &b = values_[step.right];
      value = {(a.yes & b.no) | (a.no & b.yes), (a.yes & b.yes) | (a.no & b.no)};
      break;
    }
    }
  }
}

} // namespace slugs
