// Lines of formulas as tokens.
//
// The two languages share tokens but not the rule for words.  In slugsin white
// space separates everything, so a name may be any word (x@0.0.7, a-b); only
// operators in front and primes behind are split off.  In structuredslugs a
// name consists of letters, digits, _, @ and dots, and operators stand anywhere.

#pragma once

#include "read/source.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace slugs {

enum class Token : std::uint8_t {
  Name,
  Number,
  Not,
  And,
  Or,
  Xor,
  Implies,
  Equivalent,
  Equal,
  Unequal,
  Less,
  LessEqual,
  Greater,
  GreaterEqual,
  Plus,
  Prime,
  Open,
  Close,
  Dollar,
  Question,
  Unknown,
  End
};

struct Lexeme {
  Token token;
  std::string_view text;
  Place place;
  const char *hint = nullptr; // an operator of other languages: what to write
                              // instead; the token is then the one meant
};

// Both end with a Token::End just behind the line.
std::vector<Lexeme> lex_slugsin(std::string_view line, int number);
std::vector<Lexeme> lex_structured(std::string_view line, int number);

// "'->'", "name 'x'", "the end of the line": for "found ..., expected ...".
std::string describe(const Lexeme &lexeme);

inline bool starts_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
inline bool continues_name(char c) { return starts_name(c) || is_digit(c) || c == '@' || c == '.'; }

} // namespace slugs
