// Buffer in front of a stream: strategies have millions of short tokens, and each
// stream insertion has a fixed cost.

#pragma once

#include <charconv>
#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <type_traits>

namespace slugs {

class OutputBuffer {
public:
  explicit OutputBuffer(std::ostream &out) : out_(out) { text_.reserve(capacity + reserve); }

  OutputBuffer &operator<<(std::string_view s) {
    text_ += s;
    return *this;
  }
  OutputBuffer &operator<<(char c) {
    text_ += c;
    return *this;
  }
  template <typename Unsigned, typename = std::enable_if_t<std::is_unsigned_v<Unsigned>>>
  OutputBuffer &operator<<(Unsigned n) {
    char digits[20];
    text_.append(digits, std::to_chars(digits, digits + sizeof digits, n).ptr);
    return *this;
  }
  // Write the text if the buffer is full; call it after a bounded number of insertions.
  void flush_if_full() {
    if (text_.size() >= capacity)
      flush();
  }
  void flush() {
    out_.write(text_.data(), static_cast<std::streamsize>(text_.size()));
    text_.clear();
  }

private:
  static constexpr std::size_t capacity = 1 << 16, reserve = 1 << 12;
  std::ostream &out_;
  std::string text_;
};

} // namespace slugs
