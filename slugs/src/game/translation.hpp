// From formulas to diagrams.
//
// Formulas may be deep, so they are translated in the order of their ids, operands
// first, and not by recursion.  What has been used for the last time is dropped: it
// would be dragged along in collections and reorderings.

#pragma once

#include "bdd/bdd.hpp"
#include "core/budget.hpp"
#include "core/formula.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

class Translation {
public:
  // Variable v of the formulas is current_var(v) and next_var(v) of the store.
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
  // Of operators in the formula that is being translated.
  std::vector<std::uint32_t> uses_; // to come
  std::vector<std::uint32_t> place_;
  std::vector<Bdd> values_; // at places
  std::vector<std::uint32_t> free_places_;
};

} // namespace slugs
