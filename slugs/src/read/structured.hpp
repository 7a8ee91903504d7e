// Formulas of structuredslugs: infix notation with integers.
//
// From loose to tight: <->, ->, ^, |, &, !, comparison, +.  All binary
// operators associate to the left, comparisons not at all.  A name with a prime
// or inside next(...) means the next value.
//
// Operator precedence parsing (Floyd, JACM 1963) with explicit stacks of
// operators and values, so that depth costs memory and never the call stack.

#pragma once

#include "read/declarations.hpp"
#include "read/lexer.hpp"

namespace slugs {

// Return the formula of a line; after an error, which is in `diagnostics`, the
// constant true.
FormulaId parse_infix(Lexer &line, Section section, const Scope &scope, const Specification &specification,
                      FormulaPool &pool, Diagnostics &diagnostics);

} // namespace slugs
