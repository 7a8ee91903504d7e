// Numbers, ranges and the names of bits, see read/structured/ranges.hpp.

#include "read/structured/ranges.hpp"

#include "read/messages/diagnostics.hpp"

namespace slugs {

std::optional<std::int64_t> parse_number(std::string_view digits) {
  std::int64_t number = 0;
  for (const char digit : digits) {
    number = 10 * number + (digit - '0');
    if (number > largest_number)
      return std::nullopt;
  }
  return number;
}

std::string out_of_range_message(std::string_view digits) {
  return "number " + printable(digits, 20) + " is out of range: the largest is " +
         std::to_string(largest_number);
}

std::string range_text(const Integer &integer) {
  return std::to_string(integer.min) + "..." + std::to_string(integer.max);
}

std::string bit_name(const Integer &integer, std::uint32_t bit) {
  std::string name = integer.name + "@" + std::to_string(bit);
  if (bit == 0)
    name += "." + std::to_string(integer.min) + "." + std::to_string(integer.max);
  return name;
}

bool needs_limit(const Integer &integer) {
  return (std::int64_t{1} << integer.bits) != integer.max - integer.min + 1;
}

} // namespace slugs
