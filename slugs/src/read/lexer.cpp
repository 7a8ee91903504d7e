// Both lexers, and the words of other languages.

#include "read/lexer.hpp"

#include "read/diagnostics.hpp"

#include <cassert>

namespace slugs {

namespace {

struct Spelling {
  std::string_view text;
  Token token;
  const char *hint; // nullptr for the language's own spelling
};

constexpr const char *temporal_box =
    "GR(1) has no temporal operators: what must always hold is a line of SYS_TRANS or ENV_TRANS";
constexpr const char *temporal_box_diamond = "GR(1) has no temporal operators: what must hold infinitely "
                                             "often is a line of SYS_LIVENESS or ENV_LIVENESS";
constexpr const char *temporal_diamond =
    "for 'not equal' write '!='; what must hold infinitely often is a line of SYS_LIVENESS or ENV_LIVENESS";

// Longest first, so that the first match is the right one.
constexpr Spelling spellings[] = {
    {"[]<>", Token::Unknown, temporal_box_diamond},
    {"<-->", Token::Equivalent, nullptr},
    {"<->", Token::Equivalent, nullptr},
    {"-->", Token::Implies, nullptr},
    {"<=>", Token::Equivalent, "write '<->' for 'if and only if'"},
    {"===", Token::Equal, "write a single '='"},
    {"!==", Token::Unequal, "write '!='"},
    {"...", Token::Unknown, "a range belongs to the declaration of an integer, such as x:0...7"},
    {"->", Token::Implies, nullptr},
    {"=>", Token::Implies, "write '->' for 'implies' or '>=' for 'at least'"},
    {"==", Token::Equal, "write a single '='"},
    {"=<", Token::LessEqual, "write '<='"},
    {"!=", Token::Unequal, nullptr},
    {"<=", Token::LessEqual, nullptr},
    {">=", Token::GreaterEqual, nullptr},
    {"<>", Token::Unequal, temporal_diamond},
    {"&&", Token::And, nullptr},
    {"||", Token::Or, nullptr},
    {"/\\", Token::And, nullptr},
    {"\\/", Token::Or, nullptr},
    {"[]", Token::Unknown, temporal_box},
    {"!", Token::Not, nullptr},
    {"~", Token::Not, nullptr},
    {"&", Token::And, nullptr},
    {"|", Token::Or, nullptr},
    {"^", Token::Xor, nullptr},
    {"=", Token::Equal, nullptr},
    {"<", Token::Less, nullptr},
    {">", Token::Greater, nullptr},
    {"+", Token::Plus, nullptr},
    {"'", Token::Prime, nullptr},
    {"(", Token::Open, nullptr},
    {")", Token::Close, nullptr},
    {"$", Token::Dollar, nullptr},
    {"?", Token::Question, nullptr},
    {"-", Token::Unknown, "there is no subtraction: add on the other side, as in x'+1 = x for x' = x-1"},
    {"*", Token::Unknown, "there is no multiplication: list the cases, or add repeatedly as in x+x"},
    {"/", Token::Unknown, "there is no division; 'and' is '&' or '/\\'"},
    {"%", Token::Unknown, "there is no modulo: list the cases"},
    {"#", Token::Unknown, "a comment needs a line of its own"},
    {";", Token::Unknown, "a constraint ends with its line"},
    {",", Token::Unknown, "write '&' between conditions, or one constraint on each line"},
    {":", Token::Unknown, "integers are declared in [INPUT] or [OUTPUT]"},
    {"\"", Token::Unknown, "names are written without quotes"},
    {"\xE2\x88\xA7", Token::And, "write '&'"},          // logical and
    {"\xE2\x88\xA8", Token::Or, "write '|'"},           // logical or
    {"\xC2\xAC", Token::Not, "write '!'"},              // not sign
    {"\xE2\x86\x92", Token::Implies, "write '->'"},     // arrow
    {"\xE2\x86\x94", Token::Equivalent, "write '<->'"}, // double arrow
    {"\xE2\x89\xA4", Token::LessEqual, "write '<='"},
    {"\xE2\x89\xA5", Token::GreaterEqual, "write '>='"},
    {"\xE2\x89\xA0", Token::Unequal, "write '!='"},
    {"\xE2\x80\x99", Token::Prime, "write the prime as '"}, // typographic apostrophe
};

const Spelling *operator_at(std::string_view rest) {
  assert(!rest.empty());
  for (const Spelling &spelling : spellings)
    if (spelling.text[0] == rest[0] && rest.substr(0, spelling.text.size()) == spelling.text)
      return &spelling;
  return nullptr;
}

bool all_digits(std::string_view word) {
  for (const char c : word)
    if (!is_digit(c))
      return false;
  return !word.empty();
}

Token prefix_operator(char c) {
  switch (c) {
  case '!':
    return Token::Not;
  case '&':
    return Token::And;
  case '|':
    return Token::Or;
  case '^':
    return Token::Xor;
  case '$':
    return Token::Dollar;
  case '?':
    return Token::Question;
  default:
    return Token::End;
  }
}

} // namespace

// Return the lexeme from `begin` to the lexer's position.
Lexeme Lexer::lexeme(Token token, std::size_t begin, const char *hint) const {
  const std::size_t length = token == Token::End ? 1 : at_ - begin;
  assert(begin <= at_ && at_ <= line_.size() && length > 0);
  return {token,
          token == Token::End ? std::string_view("") : line_.substr(begin, length),
          {number_, static_cast<int>(begin) + 1, static_cast<int>(length)},
          hint};
}

// A word is operators, then a number or a name, then primes.
Lexeme Lexer::slugsin() {
  if (at_ == word_end_) {
    while (at_ < line_.size() && is_blank(line_[at_]))
      ++at_;
    if (at_ == line_.size()) {
      word_end_ = at_;
      return lexeme(Token::End, at_);
    }
    word_end_ = at_;
    while (word_end_ < line_.size() && !is_blank(line_[word_end_]))
      ++word_end_;
    named_ = false;
  }
  const std::size_t begin = at_;
  assert(begin < word_end_ && word_end_ <= line_.size());
  if (named_) {
    assert(line_[at_] == '\''); // only primes are left
    ++at_;
    return lexeme(Token::Prime, begin);
  }
  if (const Token token = prefix_operator(line_[at_]); token != Token::End) {
    ++at_;
    return lexeme(token, begin);
  }
  named_ = true;
  at_ = word_end_;
  while (at_ > begin + 1 && line_[at_ - 1] == '\'')
    --at_;
  return lexeme(all_digits(line_.substr(begin, at_ - begin)) ? Token::Number : Token::Name, begin);
}

Lexeme Lexer::structured() {
  while (at_ < line_.size() && is_blank(line_[at_]))
    ++at_;
  const std::size_t begin = at_;
  if (at_ == line_.size())
    return lexeme(Token::End, begin);
  Token token = Token::Unknown;
  const char *hint = nullptr;
  if (is_digit(line_[at_])) {
    token = Token::Number;
    while (at_ < line_.size() && is_digit(line_[at_]))
      ++at_;
    if (at_ < line_.size() && starts_name(line_[at_])) {
      token = Token::Unknown;
      hint = "a name starts with a letter";
      while (at_ < line_.size() && continues_name(line_[at_]))
        ++at_;
    }
  } else if (starts_name(line_[at_])) {
    token = Token::Name;
    while (at_ < line_.size() && continues_name(line_[at_]))
      ++at_;
  } else if (const Spelling *spelling = operator_at(line_.substr(at_))) {
    token = spelling->token;
    hint = spelling->hint;
    const bool twice = spelling->text == "&&" || spelling->text == "||";
    at_ += twice && words_ == Words::StructuredPrefix ? 1 : spelling->text.size();
  } else {
    // One character, however many bytes it has in UTF-8.
    for (++at_; at_ < line_.size() && (static_cast<unsigned char>(line_[at_]) & 0xC0) == 0x80;)
      ++at_;
  }
  assert(at_ > begin);
  return lexeme(token, begin, hint);
}

Lexeme Lexer::at(int column) const {
  const std::size_t before = static_cast<std::size_t>(column) - 1;
  assert(column >= 1 && before <= line_.size());
  Lexeme result = Lexer(line_.substr(before), number_, words_, pacer_).peek();
  assert(result.place.line == number_);
  result.place.column = column;
  return result;
}

std::vector<Lexeme> lex_structured(std::string_view line, int number, BudgetPacer &pacer) {
  Lexer lexer(line, number, Words::Structured, pacer);
  std::vector<Lexeme> all{lexer.take()};
  // No valid declaration has as many, and messages need only the first ones.
  while (all.back().token != Token::End && all.size() < 100)
    all.push_back(lexer.take());
  assert(!all.empty());
  all.push_back({Token::End, "", {number, static_cast<int>(line.size()) + 1, 1}});
  return all;
}

std::string describe(const Lexeme &lexeme) {
  switch (lexeme.token) {
  case Token::End:
    return "the end of the line";
  case Token::Name:
    return "name '" + printable(lexeme.text) + "'";
  case Token::Number:
    return "number " + printable(lexeme.text);
  default:
    break;
  }
  if (lexeme.text.size() == 1 && static_cast<unsigned char>(lexeme.text[0]) < 0x20)
    return "a control character (code " + std::to_string(static_cast<int>(lexeme.text[0])) + ")";
  return "'" + printable(lexeme.text) + "'";
}

// The table of the words of other languages, see read/lexer.hpp.

namespace {

constexpr const char *always =
    "what must always hold is a line of SYS_TRANS (guarantee) or ENV_TRANS (assumption), without 'G'";
constexpr const char *again =
    "what must happen infinitely often is a line of SYS_LIVENESS (guarantee) or ENV_LIVENESS (assumption), "
    "without 'G F'";
constexpr const char *until = "GR(1) has no until: for 'a U b' write 'a | b' in SYS_TRANS with a Boolean "
                              "output that remembers b, and b "
                              "in SYS_LIVENESS";
constexpr const char *weak_until =
    "GR(1) has no weak until: for 'a W b' write 'a | b' in SYS_TRANS with a Boolean output that remembers b";

constexpr ForeignWord words[] = {
    {"G", ForeignWord::Operator, Token::Unknown, true, always},
    {"F", ForeignWord::Operator, Token::Unknown, true, again},
    {"GF", ForeignWord::Operator, Token::Unknown, true, again},
    {"FG", ForeignWord::Operator, Token::Unknown, true,
     "GR(1) cannot ask that something holds from some time on; see SYS_LIVENESS and SYS_TRANS"},
    {"U", ForeignWord::Operator, Token::Or, true, until},
    {"W", ForeignWord::Operator, Token::Or, true, weak_until},
    {"R", ForeignWord::Operator, Token::Or, true, weak_until},
    {"and", ForeignWord::Operator, Token::And, false, "write '&'"},
    {"AND", ForeignWord::Operator, Token::And, false, "write '&'"},
    {"or", ForeignWord::Operator, Token::Or, false, "write '|'"},
    {"OR", ForeignWord::Operator, Token::Or, false, "write '|'"},
    {"xor", ForeignWord::Operator, Token::Xor, false, "write '^'"},
    {"XOR", ForeignWord::Operator, Token::Xor, false, "write '^'"},
    {"not", ForeignWord::Operator, Token::Not, false, "write '!'"},
    {"NOT", ForeignWord::Operator, Token::Not, false, "write '!'"},
    {"implies", ForeignWord::Operator, Token::Implies, false, "write '->'"},
    {"iff", ForeignWord::Operator, Token::Equivalent, false, "write '<->'"},
    {"true", ForeignWord::Constant, Token::Unknown, false, "write TRUE"},
    {"True", ForeignWord::Constant, Token::Unknown, false, "write TRUE"},
    {"false", ForeignWord::Constant, Token::Unknown, false, "write FALSE"},
    {"False", ForeignWord::Constant, Token::Unknown, false, "write FALSE"},
};

} // namespace

std::string ForeignWord::message() const {
  return (temporal ? "temporal operator '" : "found '") + std::string(text) +
         (temporal ? "' is not part of GR(1)" : "', which is not an operator here");
}

const ForeignWord *foreign_word(std::string_view word, ForeignWord::Kind kind) {
  for (const ForeignWord &entry : words)
    if (word == entry.text && (kind == ForeignWord::Any || kind == entry.kind))
      return &entry;
  return nullptr;
}

} // namespace slugs
