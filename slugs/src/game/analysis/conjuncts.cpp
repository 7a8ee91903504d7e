#include "game/analysis/conjuncts.hpp"

#include <utility>

namespace slugs {

namespace {

// Set of small numbers; clear() takes time proportional to its size, not its range.
class MarkedNumbers {
public:
  explicit MarkedNumbers(std::size_t most) : marked_(most, false) {}
  // Insert a number and return whether it is new.
  bool insert(std::size_t number) {
    if (marked_[number])
      return false;
    marked_[number] = true;
    numbers_.push_back(static_cast<std::uint32_t>(number));
    return true;
  }
  void clear() {
    for (const std::uint32_t number : numbers_)
      marked_[number] = false;
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
        occurrences_[section].push_back(place - 1);
      });
    for (const Conjunct &conjunct : all)
      known[signed_number(conjunct.formula, conjunct.negative)] = 0;
  }
}

} // namespace slugs
