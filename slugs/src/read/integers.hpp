// Integer expressions as vectors of formulas.
//
// An expression denotes offset + bits, where bits is an unsigned little-endian
// vector: variable x of range min...max is min plus its bits, a number is an
// offset alone, and a sum has as many bits as its largest value needs, so nothing
// wraps around.  Comparisons move the offsets to one side and compare bit by bit.

#pragma once

#include "core/formula.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

struct IntegerValue {
  std::int64_t offset = 0;
  std::vector<FormulaId> bits;
  std::uint64_t largest = 0; // value of the bits: those beyond it are always 0, and left out
};

// The bits themselves, which may all be 1.
IntegerValue bit_vector(std::vector<FormulaId> bits);

IntegerValue sum(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b);
FormulaId equal(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b);
FormulaId less(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b);

// Bits that an unsigned number needs; 0 for 0.
std::uint32_t width(std::uint64_t number);

} // namespace slugs
