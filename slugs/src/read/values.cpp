// Adders and comparators; types and operators of infix expressions.

#include "read/values.hpp"

#include "read/declarations.hpp"
#include "read/diagnostics.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace slugs {

namespace {

using Bits = std::vector<FormulaId>;

Bits constant_bits(const FormulaPool &pool, std::uint64_t number) {
  Bits bits;
  for (; number != 0; number >>= 1)
    bits.push_back(pool.constant(number & 1));
  return bits;
}

// Return the sum, in as many bits as `largest` needs, which it never exceeds.
Bits add(FormulaPool &pool, const Bits &a, const Bits &b, std::uint64_t largest) {
  if (a.empty() || b.empty())
    return a.empty() ? b : a;
  Bits result;
  const std::size_t bits = std::max(a.size(), b.size()), needed = width(largest);
  result.reserve(needed);
  FormulaId carry = pool.constant(false);
  for (std::size_t i = 0; i < bits; ++i) {
    const FormulaId x = i < a.size() ? a[i] : pool.constant(false);
    const FormulaId y = i < b.size() ? b[i] : pool.constant(false);
    const FormulaId half = pool.exclusive_or(x, y);
    result.push_back(pool.exclusive_or(half, carry));
    if (i + 1 == bits && needed <= bits)
      return result; // there is no carry
    carry = pool.disjunction(pool.conjunction(x, y), pool.conjunction(half, carry));
  }
  if (carry != pool.constant(false))
    result.push_back(carry);
  assert(result.size() <= bits + 1);
  return result;
}

// Bits, and the largest value that they can have.
struct Number {
  Bits bits;
  std::uint64_t largest = 0;
};

Number plus(FormulaPool &pool, const Number &a, const Number &b) {
  const std::uint64_t largest = a.largest + b.largest;
  assert(largest >= a.largest); // no overflow
  return {add(pool, a.bits, b.bits, largest), largest};
}

// By doubling: a summand for each 1 of the factor.
Number multiple(FormulaPool &pool, const IntegerValue::Term &term) {
  assert(term.bits.size() < 32 && term.times > 0);
  Number result;
  Number doubled{term.bits, (std::uint64_t{1} << term.bits.size()) - 1};
  for (std::uint64_t times = term.times; times != 0; times >>= 1) {
    if (times & 1)
      result = plus(pool, result, doubled);
    doubled.bits.insert(doubled.bits.begin(), pool.constant(false));
    doubled.largest *= 2;
  }
  return result;
}

Bits total(FormulaPool &pool, const IntegerValue &value, std::uint64_t more) {
  Number result;
  for (const IntegerValue::Term &term : value.terms)
    result = plus(pool, result, multiple(pool, term));
  return plus(pool, result, {constant_bits(pool, more), more}).bits;
}

// Two expressions as plain bit vectors of one width with the same order as the
// values: the smaller offset is subtracted from both.
struct Aligned {
  Bits a;
  Bits b;
};

Aligned align(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b) {
  const std::int64_t base = std::min(a.offset, b.offset);
  assert(base >= 0);
  Aligned result{total(pool, a, static_cast<std::uint64_t>(a.offset - base)),
                 total(pool, b, static_cast<std::uint64_t>(b.offset - base))};
  const std::size_t bits = std::max(result.a.size(), result.b.size());
  result.a.resize(bits, pool.constant(false));
  result.b.resize(bits, pool.constant(false));
  assert(result.a.size() == result.b.size());
  return result;
}

} // namespace

IntegerValue bit_vector(std::vector<FormulaId> bits) { return {0, {{std::move(bits), 1}}}; }

IntegerValue sum(IntegerValue a, const IntegerValue &b) {
  assert(a.offset >= 0 && b.offset >= 0);
  a.offset += b.offset;
  for (const IntegerValue::Term &term : b.terms) {
    const auto same = std::find_if(a.terms.begin(), a.terms.end(),
                                   [&](const IntegerValue::Term &other) { return other.bits == term.bits; });
    if (same != a.terms.end())
      same->times += term.times;
    else
      a.terms.push_back(term);
  }
  return a;
}

FormulaId equal(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b) {
  const Aligned bits = align(pool, a, b);
  FormulaId result = pool.constant(true);
  for (std::size_t i = bits.a.size(); i-- > 0;)
    result = pool.conjunction(result, pool.equivalence(bits.a[i], bits.b[i]));
  return result;
}

FormulaId less(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b) {
  const Aligned bits = align(pool, a, b);
  FormulaId result = pool.constant(false);
  for (std::size_t i = 0; i < bits.a.size(); ++i) {
    const FormulaId x = bits.a[i];
    const FormulaId y = bits.b[i];
    // The higher bit decides; only if it is equal do the lower ones count.
    result = pool.disjunction(pool.conjunction(pool.negation(x), y),
                              pool.conjunction(pool.equivalence(x, y), result));
  }
  return result;
}

std::uint32_t width(std::uint64_t number) {
  std::uint32_t bits = 0;
  for (; number != 0; number >>= 1)
    ++bits;
  return bits;
}

namespace {

// Return the place from the start of `left` to the end of `right`.
Place span(Place left, Place right) {
  assert(left.line == right.line && left.column <= right.column);
  return {left.line, left.column, right.column + right.length - left.column};
}

bool compare(Token op, std::int64_t a, std::int64_t b) {
  switch (op) {
  case Token::Equal:
    return a == b;
  case Token::Unequal:
    return a != b;
  case Token::Less:
    return a < b;
  case Token::LessEqual:
    return a <= b;
  case Token::Greater:
    return a > b;
  default:
    return a >= b;
  }
}

} // namespace

Value ValueAlgebra::unknown(Place place) const {
  Value value;
  value.place = place;
  return value;
}

Value ValueAlgebra::constant(bool constant, Place place) const {
  Value value;
  value.type = Value::Type::Boolean;
  value.place = place;
  value.formula = pool_.constant(constant);
  return value;
}

Value ValueAlgebra::number(const Lexeme &lexeme) const {
  Value value = unknown(lexeme.place);
  const std::optional<std::int64_t> number = parse_number(lexeme.text);
  if (!number) {
    diagnostics_.error(lexeme.place, out_of_range_message(lexeme.text));
    return value;
  }
  value.type = Value::Type::Integer;
  assert(*number >= 0);
  value.integer.offset = *number;
  value.literal = true;
  return value;
}

Value ValueAlgebra::integer(const Integer &integer, bool next, Place place) const {
  Value value = unknown(place);
  value.type = Value::Type::Integer;
  std::vector<FormulaId> bits;
  for (std::uint32_t bit = 0; bit < integer.bits; ++bit)
    bits.push_back(pool_.variable(integer.first + bit, next));
  value.integer = bit_vector(std::move(bits));
  value.integer.offset = integer.min;
  value.variable = &integer;
  return value;
}

Value ValueAlgebra::boolean_variable(std::uint32_t index, bool next, Place place,
                                     std::string_view name) const {
  assert(!name.empty());
  Value value = unknown(place);
  value.type = Value::Type::Boolean;
  value.formula = pool_.variable(index, next);
  value.boolean_name = name;
  return value;
}

FormulaId ValueAlgebra::boolean(const Value &value) const {
  if (value.type != Value::Type::Integer)
    return value.formula;
  if (value.literal && (value.integer.offset == 0 || value.integer.offset == 1))
    return pool_.constant(value.integer.offset == 1);
  if (value.variable)
    diagnostics_.error(
        value.place, "found integer '" + printable(value.variable->name) + "', expected a Boolean formula",
        "compare it, as in " + value.variable->name + " = " + std::to_string(value.variable->min));
  else
    diagnostics_.error(value.place,
                       value.literal ? "found number " + std::to_string(value.integer.offset) +
                                           ", expected a Boolean formula"
                                     : "found an integer expression, expected a Boolean formula",
                       "integers become formulas by comparison, as in x + 1 <= y");
  return pool_.constant(true);
}

bool ValueAlgebra::is_integer(const Value &value) const {
  if (value.type == Value::Type::Boolean)
    diagnostics_.error(value.place,
                       value.boolean_name.empty()
                           ? "found a Boolean formula, expected an integer"
                           : "found Boolean variable '" + printable(value.boolean_name) +
                                 "', expected an integer",
                       "'=' and '+' work on integers; for Boolean equality write '<->', and set "
                       "parentheses around mixed operators");
  return value.type == Value::Type::Integer;
}

Value ValueAlgebra::negation(const Value &value, Place op) const {
  Value result = unknown(span(op, value.place));
  result.type = Value::Type::Boolean;
  result.formula = pool_.negation(boolean(value));
  return result;
}

Value ValueAlgebra::binary(Token op, Value left, const Value &right, const Lexeme &lexeme) const {
  switch (op) {
  case Token::And:
  case Token::Or:
  case Token::Xor:
  case Token::Implies:
  case Token::Equivalent:
    return logical(op, left, right);
  case Token::Plus:
    return arithmetic(op, std::move(left), right);
  default:
    warn_if_constant(op, left, right, lexeme);
    return arithmetic(op, std::move(left), right);
  }
}

Value ValueAlgebra::logical(Token op, const Value &left, const Value &right) const {
  Value result = unknown(span(left.place, right.place));
  result.type = Value::Type::Boolean;
  const FormulaId a = boolean(left);
  const FormulaId b = boolean(right);
  switch (op) {
  case Token::And:
    result.formula = pool_.conjunction(a, b);
    break;
  case Token::Or:
    result.formula = pool_.disjunction(a, b);
    break;
  case Token::Xor:
    result.formula = pool_.exclusive_or(a, b);
    break;
  case Token::Implies:
    result.formula = pool_.implication(a, b);
    break;
  default:
    result.formula = pool_.equivalence(a, b);
    break;
  }
  return result;
}

Value ValueAlgebra::arithmetic(Token op, Value left, const Value &right) const {
  Value result = unknown(span(left.place, right.place));
  // Both sides are checked, so that both errors are reported.
  const bool left_fits = is_integer(left);
  const bool right_fits = is_integer(right);
  if (op != Token::Plus)
    result.type = Value::Type::Boolean;
  if (!left_fits || !right_fits)
    return result;
  if (op == Token::Plus) {
    result.type = Value::Type::Integer;
    assert(left.type == Value::Type::Integer && right.type == Value::Type::Integer);
    result.integer = sum(std::move(left.integer), right.integer);
  } else {
    result.formula = comparison(op, left.integer, right.integer);
  }
  return result;
}

FormulaId ValueAlgebra::comparison(Token op, const IntegerValue &left, const IntegerValue &right) const {
  switch (op) {
  case Token::Equal:
    return equal(pool_, left, right);
  case Token::Unequal:
    return pool_.negation(equal(pool_, left, right));
  case Token::Less:
    return less(pool_, left, right);
  case Token::LessEqual:
    return pool_.negation(less(pool_, right, left));
  case Token::Greater:
    return less(pool_, right, left);
  default:
    return pool_.negation(less(pool_, left, right));
  }
}

// Comparing a variable with a number outside its range is legal (generated
// files do it) but nearly always unintended, so there is a warning.
void ValueAlgebra::warn_if_constant(Token op, const Value &left, const Value &right,
                                    const Lexeme &lexeme) const {
  const bool variable_left = left.variable && right.literal;
  if (!variable_left && !(right.variable && left.literal))
    return;
  assert(left.variable || right.variable);
  const Integer &variable = variable_left ? *left.variable : *right.variable;
  const std::int64_t number = variable_left ? right.integer.offset : left.integer.offset;
  if (number >= variable.min && number <= variable.max)
    return;
  const auto holds = [&](std::int64_t value) {
    return variable_left ? compare(op, value, number) : compare(op, number, value);
  };
  // Outside the range all values compare alike.
  diagnostics_.warning(span(left.place, right.place), "'" + std::string(lexeme.text) + "' is always " +
                                                          (holds(variable.min) ? "true" : "false") +
                                                          " here: " + printable(variable.name) +
                                                          " ranges over " + range_text(variable));
}

} // namespace slugs
