// Multipliers of all hash functions.
//
// Multiplication carries upwards only, so a hash function that uses low bits of a
// product must first fold the high bits into them.

#pragma once

#include <cstdint>

namespace slugs {

// 2^64 divided by the golden ratio: spreads small consecutive numbers (Knuth,
// The Art of Computer Programming, volume 3, section 6.4).
inline constexpr std::uint64_t golden_multiplier = 0x9E3779B97F4A7C15ull;
// Odd and without pattern, for a second step that does not undo the first.
inline constexpr std::uint64_t second_multiplier = 0xD6E8FEB86659FD93ull;

} // namespace slugs
