// The multipliers of all hash tables.
//
// A product carries upwards only, so whoever takes low bits of it brings the
// high ones down first.

#pragma once

#include <cstdint>

namespace slugs {

// 2^64 divided by the golden ratio: spreads small consecutive numbers (Knuth,
// The Art of Computer Programming, volume 3, section 6.4).
inline constexpr std::uint64_t golden_multiplier = 0x9E3779B97F4A7C15ull;
// Odd and without pattern, for a second step that must not undo the first.
inline constexpr std::uint64_t second_multiplier = 0xD6E8FEB86659FD93ull;

} // namespace slugs
