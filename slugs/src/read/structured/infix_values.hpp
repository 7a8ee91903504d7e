// Values of infix expressions: Boolean formulas and integers.
//
// A parenthesis may hold either, so types are determined while operators are
// applied.  An operand of the wrong type is reported at its position; the
// result then has unknown type and causes no further message.

#pragma once

#include "core/specification.hpp"
#include "read/lexer.hpp"
#include "read/structured/integers.hpp"

namespace slugs {

class Diagnostics;

constexpr int comparison_precedence = 7;

struct Value {
  enum class Type { Unknown, Boolean, Integer };
  Type type = Type::Unknown;
  Place place;
  FormulaId formula = 1;
  IntegerValue integer;
  std::string_view boolean_name;     // of a single Boolean variable
  const Integer *variable = nullptr; // a single integer variable
  bool literal = false;              // a number as written
};

class ValueAlgebra {
public:
  ValueAlgebra(FormulaPool &pool, Diagnostics &diagnostics) : pool_(pool), diagnostics_(diagnostics) {}

  Value unknown(Place place) const;
  Value constant(bool value, Place place) const;
  Value number(const Lexeme &lexeme) const;
  Value integer(const Integer &integer, bool next, Place place) const;
  Value boolean_variable(std::uint32_t index, bool next, Place place, std::string_view name) const;

  Value negation(const Value &value, Place op) const;
  Value binary(Token op, Value left, const Value &right, const Lexeme &lexeme) const;

  // Return a value as a Boolean formula; report an integer.
  FormulaId boolean(const Value &value) const;

private:
  Value logical(Token op, const Value &left, const Value &right) const;
  Value arithmetic(Token op, Value left, const Value &right) const;
  bool is_integer(const Value &value) const; // reports a Boolean
  FormulaId comparison(Token op, const IntegerValue &left, const IntegerValue &right) const;
  void warn_if_constant(Token op, const Value &left, const Value &right, const Lexeme &lexeme) const;

  FormulaPool &pool_;
  Diagnostics &diagnostics_;
};

} // namespace slugs
