// Both lexers, see read/lexer.hpp.

#include "read/lexer.hpp"

#include "read/diagnostics.hpp"

namespace slugs {

namespace {

struct Spelling {
  std::string_view text;
  Token token;
  const char *hint; // nullptr for the language's own spelling
};

constexpr const char *temporal_box =
    "GR(1) has no temporal operators: what must always hold is a line of SYS_TRANS or ENV_TRANS";
constexpr const char *temporal_diamond =
    "for 'not equal' write '!='; what must hold again and again is a line of SYS_LIVENESS or ENV_LIVENESS";

// Longest first, so that the first match is the right one.
constexpr Spelling spellings[] = {
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

Place place_of(int line, std::size_t begin, std::size_t length) {
  return {line, static_cast<int>(begin) + 1, static_cast<int>(length)};
}

const Spelling *operator_at(std::string_view rest) {
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

// One word of slugsin without its leading operators: a number or a name, then
// primes.
void lex_word(std::string_view line, std::size_t begin, std::size_t end, int number,
              std::vector<Lexeme> &out) {
  std::size_t primes = end;
  while (primes > begin + 1 && line[primes - 1] == '\'')
    --primes;
  const std::string_view word = line.substr(begin, primes - begin);
  out.push_back({all_digits(word) ? Token::Number : Token::Name, word, place_of(number, begin, word.size())});
  for (; primes < end; ++primes)
    out.push_back({Token::Prime, line.substr(primes, 1), place_of(number, primes, 1)});
}

} // namespace

std::vector<Lexeme> lex_slugsin(std::string_view line, int number) {
  std::vector<Lexeme> out;
  std::size_t at = 0;
  while (true) {
    while (at < line.size() && is_blank(line[at]))
      ++at;
    if (at == line.size())
      break;
    std::size_t end = at;
    while (end < line.size() && !is_blank(line[end]))
      ++end;
    for (; at < end; ++at) {
      Token token;
      switch (line[at]) {
      case '!':
        token = Token::Not;
        break;
      case '&':
        token = Token::And;
        break;
      case '|':
        token = Token::Or;
        break;
      case '^':
        token = Token::Xor;
        break;
      case '$':
        token = Token::Dollar;
        break;
      case '?':
        token = Token::Question;
        break;
      default:
        token = Token::End;
        break;
      }
      if (token == Token::End)
        break;
      out.push_back({token, line.substr(at, 1), place_of(number, at, 1)});
    }
    if (at < end)
      lex_word(line, at, end, number, out);
    at = end;
  }
  out.push_back({Token::End, "", place_of(number, line.size(), 1)});
  return out;
}

std::vector<Lexeme> lex_structured(std::string_view line, int number) {
  std::vector<Lexeme> out;
  out.reserve(line.size() / 3 + 2); // about as dense as people write
  std::size_t at = 0;
  while (true) {
    while (at < line.size() && is_blank(line[at]))
      ++at;
    if (at == line.size())
      break;
    const std::size_t begin = at;
    Token token = Token::Unknown;
    const char *hint = nullptr;
    if (is_digit(line[at])) {
      token = Token::Number;
      while (at < line.size() && is_digit(line[at]))
        ++at;
      if (at < line.size() && starts_name(line[at])) {
        token = Token::Unknown;
        hint = "a name starts with a letter";
        while (at < line.size() && continues_name(line[at]))
          ++at;
      }
    } else if (starts_name(line[at])) {
      token = Token::Name;
      while (at < line.size() && continues_name(line[at]))
        ++at;
    } else if (const Spelling *spelling = operator_at(line.substr(at))) {
      token = spelling->token;
      hint = spelling->hint;
      at += spelling->text.size();
    } else {
      // One character, however many bytes it has in UTF-8.
      for (++at; at < line.size() && (static_cast<unsigned char>(line[at]) & 0xC0) == 0x80;)
        ++at;
    }
    out.push_back({token, line.substr(begin, at - begin), place_of(number, begin, at - begin), hint});
  }
  out.push_back({Token::End, "", place_of(number, line.size(), 1)});
  return out;
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

} // namespace slugs
