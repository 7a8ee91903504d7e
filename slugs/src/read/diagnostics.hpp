// The text of a file, messages about it, and suggestions.

#pragma once

#include <cassert>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

namespace slugs {

// The text of an input file as lines, the unit of both languages.
//
// A view: the caller keeps the text alive.  A byte order mark and carriage
// returns before line ends are not part of any line.

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
    assert(number >= 1 && number <= line_count());
    const std::size_t begin = starts_[static_cast<std::size_t>(number) - 1];
    std::size_t end = starts_[static_cast<std::size_t>(number)];
    assert(begin < end && end <= text_.size());
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

// Return the length in bytes of the first character of the text, if only some
// programs end a line there, or no text should contain it: control characters except
// the tab, U+2028 and U+2029. 0 for any other character.
std::size_t foreign_length(std::string_view text);

inline bool is_blank(char c) { return c == ' ' || c == '\t'; }
inline bool is_digit(char c) { return c >= '0' && c <= '9'; }
std::string_view trimmed(std::string_view text);

// Errors and warnings of an input file, shown so that a user can fix them.
//
// Readers do not stop at the first error: they collect all, and the caller
// prints them in the order of the file.  A diagnostic names what was found and
// what was expected; its hint says what to write instead.

enum class Severity { Error, Warning };

struct Diagnostic {
  Severity severity;
  Place place;
  std::string message;
  std::string hint; // may be empty
};

class Diagnostics {
public:
  explicit Diagnostics(const Source &source) : source_(source) {}

  void error(Place place, std::string message, std::string hint = "");
  void warning(Place place, std::string message, std::string hint = "");

  const Source &source() const { return source_; }
  std::size_t error_count() const {
    assert(errors_ <= all_.size());
    return errors_;
  }
  std::vector<Diagnostic> sorted() const;

  // "file:line:column: error: message", the source line, a caret line, the
  // hint; for each diagnostic (at most `most` of each kind), then a count.
  void print(std::ostream &out, std::size_t most = 1000) const;

private:
  void print_one(std::ostream &out, const Diagnostic &diagnostic) const;

  const Source &source_;
  std::vector<Diagnostic> all_;
  std::size_t errors_ = 0;
};

// Return text for a message: control characters and broken UTF-8 made visible, cut
// after `most` characters.
std::string printable(std::string_view text, std::size_t most = 60);

// "Did you mean": the known word nearest to one that is not known.
//
// Distance is that of Damerau (CACM 1964) in its restricted form: insertions,
// deletions, substitutions and swaps of neighbours each cost one.  A word
// counts as near if at most a third of it (at least one letter) is wrong, case
// aside, or if it begins one known word only.

// Return the nearest of `known`, the first of equals; empty if none is near.
std::string nearest_word(std::string_view word, const std::vector<std::string> &known);

} // namespace slugs
