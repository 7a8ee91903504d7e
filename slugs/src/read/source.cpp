// Splitting a text into lines, see read/source.hpp.

#include "read/source.hpp"

#include <algorithm>
#include <utility>

namespace slugs {

Source::Source(std::string file, std::string_view text) : file_(std::move(file)), text_(text) {
  if (text_.substr(0, 3) == "\xEF\xBB\xBF")
    text_.remove_prefix(3);
  starts_.reserve(static_cast<std::size_t>(std::count(text_.begin(), text_.end(), '\n')) + 2);
  for (std::size_t at = 0; at < text_.size();) {
    starts_.push_back(at);
    const std::size_t end = text_.find('\n', at);
    at = end == std::string_view::npos ? text_.size() : end + 1;
  }
  starts_.push_back(text_.size());
}

std::size_t foreign_length(std::string_view text) {
  const auto byte = [&](std::size_t at) {
    return at < text.size() ? static_cast<unsigned char>(text[at]) : 0u;
  };
  if ((byte(0) < 0x20 && byte(0) != '\t') || byte(0) == 0x7F)
    return 1;
  if (byte(0) == 0xC2 && byte(1) >= 0x80 && byte(1) < 0xA0)
    return 2;
  return byte(0) == 0xE2 && byte(1) == 0x80 && (byte(2) == 0xA8 || byte(2) == 0xA9) ? 3 : 0;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front()))
    text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back()))
    text.remove_suffix(1);
  return text;
}

} // namespace slugs
