// The start order of the variables.

#pragma once

#include "core/specification.hpp"

#include <cstdint>
#include <functional>
#include <vector>

namespace slugs {

// The conjuncts of a formula, found through nested conjunctions and negated
// disjunctions; their conjunction is the formula.
std::vector<FormulaId> conjuncts(FormulaPool &formulas, FormulaId formula);

// Whether one of the formula's variables, present or next, is as asked for.
bool mentions(const FormulaPool &formulas, FormulaId formula,
              const std::function<bool(const FormulaNode &)> &asked);

// The variables (indices into Specification::variables, current or next) that
// occur in the formula, ascending.
std::vector<std::uint32_t> variables_of(const FormulaPool &formulas, FormulaId formula);

// An order in which variables that share constraints are close: order[k] is the
// variable at position k.
std::vector<std::uint32_t> force_order(const Specification &specification);

} // namespace slugs
