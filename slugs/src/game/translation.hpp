// Translation of formulas to BDDs.
//
// Formulas may be deep, so operators are translated in the order of their ids, operands
// first, without recursion.  Intermediate results are dropped after their last use, since
// collections and reorderings would have to process them.

#pragma once

#include "bdd/bdd.hpp"
#include "core/budget.hpp"
#include "core/formula.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

class Translation {
public:
  // Variable v of the formulas corresponds to current_var(v) and next_var(v) of the store.
  Translation(BddStore &store, const FormulaPool &formulas);

  Bdd operator()(FormulaId formula);

private:
  bool is_operator(FormulaId id) const { return formulas_[id].op >= Op::Not; }
  Bdd take(FormulaId id);
  void keep(FormulaId id, const Bdd &value);
  void bring_into_order(std::vector<FormulaId> &needed);

  BddStore &store_;
  const FormulaPool &formulas_;
  BudgetPacer pacer_;
  // Operators of the formula in translation, indexed by id:
  std::vector<std::uint32_t> uses_;  // remaining uses
  std::vector<std::uint32_t> place_; // index into values_
  std::vector<Bdd> values_;
  std::vector<std::uint32_t> free_places_;
};

} // namespace slugs
