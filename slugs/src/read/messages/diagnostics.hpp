// Errors and warnings of an input file, shown so that a user can fix them.
//
// Readers do not stop at the first error: they collect all, and the caller
// prints them in the order of the file.  A diagnostic names what was found and
// what was expected; its hint says what to write instead.

#pragma once

#include "read/source.hpp"

#include <iosfwd>
#include <string>
#include <vector>

namespace slugs {

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
  std::size_t error_count() const { return errors_; }
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

// Text for a message: control characters and broken UTF-8 made visible, cut
// after `most` characters.
std::string printable(std::string_view text, std::size_t most = 60);

} // namespace slugs
