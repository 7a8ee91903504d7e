// Comparisons of sums of many different integers.
//
// An adder for each summand makes formulas that are short and hard: the diagrams
// of the sums on the way are far larger than that of the comparison, which only
// has to know how much may still come.  So a long sum becomes the decision
// diagram of "so much is left of the bound", summand by summand in the order of
// declaration, in which diagrams start (the counting argument behind
// Een and Soerensson, Translating Pseudo-Boolean Constraints into SAT, JSAT 2006).

#pragma once

#include "core/budget.hpp"
#include "core/formula.hpp"
#include "read/structured/integers.hpp"

#include <optional>

namespace slugs {

// Nothing if the sums are short, or if there are too many amounts that may be left.
std::optional<FormulaId> equal_long_sums(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b,
                                         BudgetPacer &pacer);
std::optional<FormulaId> less_of_long_sums(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b,
                                           BudgetPacer &pacer);

} // namespace slugs
