// Comparisons of sums of many different integers.
//
// With an adder for each summand formulas are short but diagrams are large: those
// of the partial sums are far larger than that of the comparison, which depends
// only on the rest of the bound.  So a long sum becomes a decision diagram over
// the rest of the bound, summand by summand in the order of declaration, in which
// diagrams start (the counting argument behind Een and Soerensson, Translating
// Pseudo-Boolean Constraints into SAT, JSAT 2006).

#pragma once

#include "core/budget.hpp"
#include "core/formula.hpp"
#include "read/structured/integers.hpp"

#include <optional>

namespace slugs {

// Nothing if the sums are short, or if too many rests of the bound are possible.
std::optional<FormulaId> equal_long_sums(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b,
                                         BudgetPacer &pacer);
std::optional<FormulaId> less_of_long_sums(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b,
                                           BudgetPacer &pacer);

} // namespace slugs
