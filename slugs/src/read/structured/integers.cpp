// Adders and comparators, see read/structured/integers.hpp.

#include "read/structured/integers.hpp"

#include <algorithm>
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

// The sum, in as many bits as `largest` needs, which it never exceeds.
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
  return result;
}

// Bits, and the largest value that they can have.
struct Number {
  Bits bits;
  std::uint64_t largest = 0;
};

Number plus(FormulaPool &pool, const Number &a, const Number &b) {
  const std::uint64_t largest = a.largest + b.largest;
  return {add(pool, a.bits, b.bits, largest), largest};
}

// By doubling: a summand for each 1 of the factor.
Number multiple(FormulaPool &pool, const IntegerValue::Term &term) {
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
  Aligned result{total(pool, a, static_cast<std::uint64_t>(a.offset - base)),
                 total(pool, b, static_cast<std::uint64_t>(b.offset - base))};
  const std::size_t bits = std::max(result.a.size(), result.b.size());
  result.a.resize(bits, pool.constant(false));
  result.b.resize(bits, pool.constant(false));
  return result;
}

} // namespace

IntegerValue bit_vector(std::vector<FormulaId> bits) { return {0, {{std::move(bits), 1}}}; }

IntegerValue sum(IntegerValue a, const IntegerValue &b) {
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

} // namespace slugs
