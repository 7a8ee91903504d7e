// What the constraints of a specification consist of, and which variables they read.

#pragma once

#include "core/specification.hpp"

#include <cstdint>
#include <functional>
#include <vector>

namespace slugs {

// The conjuncts of a formula, found through nested conjunctions and negated
// disjunctions; their conjunction is the formula.
std::vector<FormulaId> conjuncts(FormulaPool &formulas, FormulaId formula);
// Those of all constraints of a section, each once.
std::vector<FormulaId> conjuncts(const Specification &specification, FormulaPool &formulas, Section section);

// Whether one of the formula's variables, present or next, is as asked for.
bool mentions(const FormulaPool &formulas, FormulaId formula,
              const std::function<bool(const FormulaNode &)> &asked);

// The variables (indices into Specification::variables, current or next) that
// occur in the formula, ascending.
std::vector<std::uint32_t> variables_of(const FormulaPool &formulas, FormulaId formula);

} // namespace slugs
