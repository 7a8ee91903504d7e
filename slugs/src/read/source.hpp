// The text of an input file as lines, the unit of both languages.
//
// A view: the caller keeps the text alive.  A byte order mark and carriage
// returns before line ends are not part of any line.

#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace slugs {

// A stretch of one line.  Line and column count from 1 in bytes; line 0 means
// the file as a whole.
struct Place {
  int line = 0;
  int column = 1;
  int length = 1;
};

class Source {
public:
  Source(std::string file, std::string_view text);

  const std::string &file() const { return file_; }
  int line_count() const { return static_cast<int>(lines_.size()); }
  std::string_view line(int number) const { return lines_[static_cast<std::size_t>(number - 1)]; }

private:
  std::string file_;
  std::vector<std::string_view> lines_;
};

inline bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\r'; }
inline bool is_digit(char c) { return c >= '0' && c <= '9'; }
std::string_view trimmed(std::string_view text);

} // namespace slugs
