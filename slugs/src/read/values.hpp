// Integers and Boolean formulas in infix expressions.

#pragma once

#include "core/formula.hpp"
#include "core/specification.hpp"
#include "read/lexer.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

// Integer expressions as sums of vectors of formulas.
//
// An expression denotes offset + a sum of multiples of bits, where bits is an
// unsigned little-endian vector: variable x of range min...max is min plus its bits,
// a number is an offset alone.  Only comparisons add, when it is known how often
// each vector occurs: x + x + x takes an adder for each bit of 3, not for each x.  A
// sum has as many bits as its largest value needs, so nothing wraps around.
// Comparisons move the offsets to one side and compare bit by bit.

struct IntegerValue {
  struct Term {
    std::vector<FormulaId> bits; // which may all be 1
    std::uint64_t times = 1;
  };
  std::int64_t offset = 0;
  std::vector<Term> terms; // of different bits, in the order in which they first occur
};

IntegerValue bit_vector(std::vector<FormulaId> bits);

IntegerValue sum(IntegerValue a, const IntegerValue &b);
FormulaId equal(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b);
FormulaId less(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b);

// Return the number of bits that an unsigned number needs; 0 for 0.
std::uint32_t width(std::uint64_t number);

// Values of infix expressions: Boolean formulas and integers.
//
// A parenthesis may hold either, so types are determined while operators are
// applied.  An operand of the wrong type is reported at its position; the
// result then has unknown type and causes no further message.

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

  // Return a value as a Boolean formula; report an error for an integer.
  FormulaId boolean(const Value &value) const;

private:
  Value logical(Token op, const Value &left, const Value &right) const;
  Value arithmetic(Token op, Value left, const Value &right) const;
  bool is_integer(const Value &value) const; // reports an error for a Boolean
  FormulaId comparison(Token op, const IntegerValue &left, const IntegerValue &right) const;
  void warn_if_constant(Token op, const Value &left, const Value &right, const Lexeme &lexeme) const;

  FormulaPool &pool_;
  Diagnostics &diagnostics_;
};

} // namespace slugs
