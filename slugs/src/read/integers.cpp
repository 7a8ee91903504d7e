// Adders and comparators, see read/integers.hpp.

#include "read/integers.hpp"

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
    const FormulaId half = pool.exclusive(x, y);
    result.push_back(pool.exclusive(half, carry));
    if (i + 1 == bits && needed <= bits)
      return result; // there is no carry
    carry = pool.disjunction(pool.conjunction(x, y), pool.conjunction(half, carry));
  }
  if (carry != pool.constant(false))
    result.push_back(carry);
  return result;
}

// Two expressions as plain bit vectors of one width with the same order as the
// values: the smaller offset is subtracted from both.
struct Aligned {
  Bits a;
  Bits b;
};

Bits raised(FormulaPool &pool, const IntegerValue &value, std::uint64_t by) {
  return add(pool, value.bits, constant_bits(pool, by), value.largest + by);
}

Aligned align(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b) {
  const std::int64_t base = std::min(a.offset, b.offset);
  Aligned result{raised(pool, a, static_cast<std::uint64_t>(a.offset - base)),
                 raised(pool, b, static_cast<std::uint64_t>(b.offset - base))};
  const std::size_t bits = std::max(result.a.size(), result.b.size());
  result.a.resize(bits, pool.constant(false));
  result.b.resize(bits, pool.constant(false));
  return result;
}

} // namespace

IntegerValue bit_vector(std::vector<FormulaId> bits) {
  const std::uint64_t largest = (std::uint64_t{1} << bits.size()) - 1; // an integer has at most 31
  return {0, std::move(bits), largest};
}

IntegerValue sum(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b) {
  const std::uint64_t largest = a.largest + b.largest;
  return {a.offset + b.offset, add(pool, a.bits, b.bits, largest), largest};
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
