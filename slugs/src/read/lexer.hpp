// Lines of formulas as tokens.
//
// The two languages share tokens but not the rule for words.  In slugsin white
// space separates everything, so a name may be any word (x@0.0.7, a-b); only
// leading operators and trailing primes are split off.  In structuredslugs a
// name consists of letters, digits, _, @ and dots, and operators stand anywhere.

#pragma once

#include "core/budget.hpp"
#include "read/diagnostics.hpp"

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
  const char *hint = nullptr; // for an operator of another language: what to write
                              // instead; `token` is then the intended one
};

enum class Words : std::uint8_t {
  Slugsin,
  Structured,
  StructuredPrefix, // a prefix line of structuredslugs: "&&" and "||" are two operators each
};

// The tokens of a line, one at a time, since a line may have millions.  After
// the last one, it returns Token::End just after the line, repeatedly.
class Lexer {
public:
  Lexer(std::string_view line, int number, Words words, BudgetPacer &pacer)
      : line_(line), number_(number), words_(words), pacer_(pacer) {
    advance();
  }

  const Lexeme &peek() const { return next_; }
  Lexeme take() {
    const Lexeme taken = next_;
    advance();
    return taken;
  }
  // Return the token that begins at a column where one has begun before.
  Lexeme at(int column) const;

private:
  void advance() {
    pacer_.step();
    next_ = words_ == Words::Slugsin ? slugsin() : structured();
  }
  Lexeme slugsin();
  Lexeme structured();
  Lexeme lexeme(Token token, std::size_t begin, const char *hint = nullptr) const;

  std::string_view line_;
  int number_;
  Words words_;
  BudgetPacer &pacer_;
  std::size_t at_ = 0;
  std::size_t word_end_ = 0; // slugsin: of the word that at_ is in
  bool named_ = false;       // slugsin: of this word only primes are left
  Lexeme next_{};
};

// Return all tokens of a line of structuredslugs, for declarations.
std::vector<Lexeme> lex_structured(std::string_view line, int number, BudgetPacer &pacer);

// Return a token as in "found ..., expected ...": "'->'", "name 'x'", "the end of the line".
std::string describe(const Lexeme &lexeme);

inline bool starts_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
inline bool continues_name(char c) { return starts_name(c) || is_digit(c) || c == '@' || c == '.'; }

// Words of LTL and other languages, and what to write here instead.
//
// They apply only if no variable of that name is declared.

struct ForeignWord {
  enum Kind { Operator, Constant, Any };
  const char *text;
  Kind kind;
  Token meaning; // to continue with; Unknown: skip a unary temporal operator
  bool temporal;
  const char *hint;

  std::string message() const;
};

// Return the entry for `word` if its kind is `kind` (Any: whatever its kind).
const ForeignWord *foreign_word(std::string_view word, ForeignWord::Kind kind);

} // namespace slugs
