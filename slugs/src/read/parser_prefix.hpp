// Formulas of slugsin: prefix notation with memory buffers.
//
//   formula ::= ! formula | & formula formula | "|" formula formula
//             | ^ formula formula | 0 | 1 | name | name '
//             | $ n formula ... formula      n formulas, the value is the last
//             | ? i                          entry i of the innermost buffer
//
// Parsed with an explicit stack of operators that wait for operands, so that
// depth costs memory and never the call stack.

#pragma once

#include "read/lexer.hpp"
#include "read/scope.hpp"

namespace slugs {

// The formula of a line; true after an error, which is in `diagnostics` then.
FormulaId parse_prefix(const std::vector<Lexeme> &line, Section section, const Scope &scope,
                       FormulaPool &pool, Diagnostics &diagnostics);

} // namespace slugs
