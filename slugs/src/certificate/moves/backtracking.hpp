// All solutions of a few formulas over a few variables, by backtracking.
//
// A branch is abandoned as soon as three-valued evaluation finds a formula
// false.  The last six variables are not branched on: their 64 valuations are
// the lanes of one evaluation.

#pragma once

#include "certificate/moves/remainders.hpp"
#include "core/budget.hpp"
#include "core/formula.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

// Return at most `most` valuations of `variables` that satisfy all formulas.
// The formulas mention no other variable; `variable_count` bounds all indices.
std::vector<std::vector<bool>> solutions(const FormulaPool &pool, const std::vector<FormulaId> &formulas,
                                         const std::vector<OpenVariable> &variables,
                                         std::size_t variable_count, std::uint64_t most,
                                         const Budget &budget);

} // namespace slugs
