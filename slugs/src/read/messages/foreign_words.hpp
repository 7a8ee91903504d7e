// Words of LTL and other languages, and what to write here instead.
//
// They apply only if no variable of that name is declared.

#pragma once

#include "read/lexer.hpp"

#include <string>
#include <string_view>

namespace slugs {

struct ForeignWord {
  enum Kind { Operator, Constant, Any };
  const char *text;
  Kind kind;
  Token meaning; // how to read on; for a unary temporal operator Unknown: skip it
  bool temporal;
  const char *hint;

  std::string message() const;
};

// The entry for `word` if its kind is `kind` (Any: whatever its kind).
const ForeignWord *foreign_word(std::string_view word, ForeignWord::Kind kind);

} // namespace slugs
