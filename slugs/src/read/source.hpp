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
  int line_count() const { return static_cast<int>(starts_.size()) - 1; }
  std::string_view line(int number) const {
    const std::size_t begin = starts_[static_cast<std::size_t>(number) - 1];
    std::size_t end = starts_[static_cast<std::size_t>(number)];
    if (text_[end - 1] == '\n')
      --end;
    if (end > begin && text_[end - 1] == '\r')
      --end;
    return text_.substr(begin, end - begin);
  }

private:
  std::string file_;
  std::string_view text_;
  std::vector<std::size_t> starts_; // of the lines, and the end
};

// Length in bytes of the first character of the text, if only some programs end
// a line there, or no text should contain it: control characters except the
// tab, U+2028 and U+2029. 0 for any other character.
std::size_t foreign_length(std::string_view text);

inline bool is_blank(char c) { return c == ' ' || c == '\t'; }
inline bool is_digit(char c) { return c >= '0' && c <= '9'; }
std::string_view trimmed(std::string_view text);

} // namespace slugs
