// Numbers and ranges as written in a structured file, and their limits.

#pragma once

#include "core/specification.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace slugs {

// So that sums of any length that fits in memory stay far inside 64 bits.
inline constexpr std::int64_t largest_number = 2147483647;

// The number that the digits denote; nothing if it is larger than allowed.
std::optional<std::int64_t> parse_number(std::string_view digits);
std::string out_of_range_message(std::string_view digits);

// "0...7"
std::string range_text(const Integer &integer);

// Names of the bits: x@0.min.max, x@1, x@2, ...
std::string bit_name(const Integer &integer, std::uint32_t bit);

// Whether the bits can hold a value above max, so that a limit is needed.
bool needs_limit(const Integer &integer);

} // namespace slugs
