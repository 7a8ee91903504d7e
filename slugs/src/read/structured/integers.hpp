// Integer expressions as sums of vectors of formulas.
//
// An expression denotes offset + a sum of multiples of bits, where bits is an
// unsigned little-endian vector: variable x of range min...max is min plus its bits,
// a number is an offset alone.  Only comparisons add, when it is known how often
// each vector occurs: x + x + x takes an adder for each bit of 3, not for each x.  A
// sum has as many bits as its largest value needs, so nothing wraps around.
// Comparisons move the offsets to one side and compare bit by bit.

#pragma once

#include "core/formula.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

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

// Bits that an unsigned number needs; 0 for 0.
std::uint32_t width(std::uint64_t number);

} // namespace slugs
