// See certificate/graph/json_reader.hpp.

#include "certificate/graph/json_reader.hpp"

#include "read/messages/diagnostics.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace slugs {

JsonReader::JsonReader(std::string file, std::string_view text, const Budget &budget)
    : file_(std::move(file)), text_(text), pacer_(budget) {
  if (text_.substr(0, 3) == "\xEF\xBB\xBF")
    at_ = 3;
}

void JsonReader::fail(const std::string &message) const {
  const std::string_view before = text_.substr(0, at_);
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t start = before.rfind('\n');
  const std::size_t column = start == std::string_view::npos ? at_ + 1 : at_ - start;
  throw JsonError(file_ + ":" + std::to_string(line) + ":" + std::to_string(column) + ": error: " + message);
}

std::string JsonReader::found() const {
  return at_ == text_.size() ? "the end of the file" : "'" + printable(text_.substr(at_, 1)) + "'";
}

void JsonReader::blanks() {
  pacer_.step();
  while (at_ < text_.size() &&
         (text_[at_] == ' ' || text_[at_] == '\n' || text_[at_] == '\t' || text_[at_] == '\r'))
    ++at_;
}

bool JsonReader::accept(char c) {
  blanks();
  if (at_ == text_.size() || text_[at_] != c)
    return false;
  ++at_;
  return true;
}

void JsonReader::expect(char c) {
  if (!accept(c))
    fail("found " + found() + ", expected '" + c + "'");
}

std::string JsonReader::string() {
  blanks();
  if (at_ == text_.size() || text_[at_] != '"')
    fail("found " + found() + ", expected a string");
  ++at_;
  std::string out;
  while (true) {
    if (at_ == text_.size() || static_cast<unsigned char>(text_[at_]) < 0x20)
      fail("found " + found() + " inside a string, expected '\"'");
    const char c = text_[at_++];
    if (c == '"')
      return out;
    if (c == '\\')
      append_escape(out);
    else
      out += c;
  }
}

unsigned JsonReader::hex_digits() {
  unsigned value = 0;
  for (int i = 0; i < 4; ++i, ++at_) {
    const char c = at_ < text_.size() ? text_[at_] : '\0';
    const int digit = c >= '0' && c <= '9'   ? c - '0'
                      : c >= 'a' && c <= 'f' ? c - 'a' + 10
                      : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                             : -1;
    if (digit < 0)
      fail("found " + found() + ", expected a hexadecimal digit");
    value = 16 * value + static_cast<unsigned>(digit);
  }
  return value;
}

void JsonReader::append_escape(std::string &out) {
  const char c = at_ < text_.size() ? text_[at_++] : '\0';
  switch (c) {
  case 'n':
    out += '\n';
    return;
  case 't':
    out += '\t';
    return;
  case 'r':
    out += '\r';
    return;
  case 'b':
    out += '\b';
    return;
  case 'f':
    out += '\f';
    return;
  case '"':
  case '\\':
  case '/':
    out += c;
    return;
  case 'u':
    break;
  default:
    fail("found an unknown escape in a string");
  }
  unsigned code = hex_digits();
  if (code >= 0xD800 && code < 0xDC00 && text_.substr(at_, 2) == "\\u") {
    at_ += 2;
    code = 0x10000 + ((code - 0xD800) << 10) + ((hex_digits() - 0xDC00) & 0x3FF);
  }
  if (code < 0x80) {
    out += static_cast<char>(code);
  } else if (code < 0x800) {
    out += static_cast<char>(0xC0 | (code >> 6));
    out += static_cast<char>(0x80 | (code & 0x3F));
  } else {
    if (code >= 0x10000)
      out += static_cast<char>(0xF0 | (code >> 18));
    out += static_cast<char>(code >= 0x10000 ? 0x80 | ((code >> 12) & 0x3F) : 0xE0 | (code >> 12));
    out += static_cast<char>(0x80 | ((code >> 6) & 0x3F));
    out += static_cast<char>(0x80 | (code & 0x3F));
  }
}

std::uint64_t JsonReader::natural() {
  blanks();
  const std::size_t start = at_;
  std::uint64_t value = 0;
  while (at_ < text_.size() && is_digit(text_[at_])) {
    const unsigned digit = static_cast<unsigned>(text_[at_] - '0');
    if (value > (std::numeric_limits<std::uint64_t>::max() - digit) / 10)
      fail("the number is too large");
    value = 10 * value + digit;
    ++at_;
  }
  if (at_ == start)
    fail("found " + found() + ", expected a natural number");
  return value;
}

void JsonReader::skip_scalar() {
  if (at_ < text_.size() && text_[at_] == '"') {
    string();
    return;
  }
  for (const std::string_view word : {"true", "false", "null"})
    if (text_.substr(at_, word.size()) == word) {
      at_ += word.size();
      return;
    }
  const std::size_t start = at_;
  while (at_ < text_.size() &&
         (is_digit(text_[at_]) || std::string_view("+-.eE").find(text_[at_]) != std::string_view::npos))
    ++at_;
  if (at_ == start)
    fail("found " + found() + ", expected a value");
}

// Iterative, since the nesting is unbounded: `open` holds the closing brackets
// that are due.
void JsonReader::skip() {
  std::string open;
  do {
    blanks();
    if (accept('{')) {
      open += '}';
      if (!accept('}')) {
        string();
        expect(':');
        continue;
      }
    } else if (accept('[')) {
      open += ']';
      if (!accept(']'))
        continue;
    } else {
      skip_scalar();
      open += ' '; // a scalar closes immediately
    }
    // A value has ended, and with it perhaps those around it.
    open.pop_back();
    while (!open.empty() && !accept(',')) {
      expect(open.back());
      open.pop_back();
    }
    if (!open.empty() && open.back() == '}') {
      string();
      expect(':');
    }
  } while (!open.empty());
}

void JsonReader::end() {
  blanks();
  if (at_ != text_.size())
    fail("found " + found() + ", expected the end of the file");
}

} // namespace slugs
