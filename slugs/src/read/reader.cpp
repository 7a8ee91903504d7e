// Telling the languages apart and running the reader of each, see
// read/reader.hpp.
//
// Sections may come in any order, so a first pass collects their lines, a
// second declares the variables, and only then formulas are parsed.

#include "read/reader.hpp"

#include "read/declarations.hpp"
#include "read/lexer.hpp"
#include "read/parser_infix.hpp"
#include "read/parser_prefix.hpp"
#include "read/sections.hpp"

namespace slugs {

namespace {

// Whether a line is prefix notation: behind leading negations it starts with an
// operator that no infix formula can start with.  A line such as "! a" is both.
bool is_prefix(const std::vector<Lexeme> &line) {
  std::size_t at = 0;
  while (line[at].token == Token::Not)
    ++at;
  switch (line[at].token) {
  case Token::And:
  case Token::Or:
  case Token::Xor:
  case Token::Dollar:
  case Token::Question:
    return true;
  default:
    return false;
  }
}

// In prefix notation "&&" and "||" are two operators each, not one.
std::vector<Lexeme> as_prefix(const std::vector<Lexeme> &line) {
  std::vector<Lexeme> result;
  for (const Lexeme &lexeme : line) {
    result.push_back(lexeme);
    if (lexeme.text != "&&" && lexeme.text != "||")
      continue;
    Lexeme &first = result.back();
    first.text = lexeme.text.substr(0, 1);
    first.place.length = 1;
    Lexeme second = first;
    ++second.place.column;
    result.push_back(second);
  }
  return result;
}

// Whether a line has what only infix lines have.  `TRUE` is a constant of
// structuredslugs, unless it is the name of a variable.
bool is_infix(const std::vector<Lexeme> &line, bool constants) {
  for (const Lexeme &lexeme : line)
    switch (lexeme.token) {
    case Token::And:
    case Token::Or:
    case Token::Xor:
    case Token::Implies:
    case Token::Equivalent:
    case Token::Equal:
    case Token::Unequal:
    case Token::Less:
    case Token::LessEqual:
    case Token::Greater:
    case Token::GreaterEqual:
    case Token::Plus:
    case Token::Open:
    case Token::Close:
      return true;
    case Token::Not:
      if (lexeme.text == "~")
        return true;
      break;
    case Token::Name:
      if (constants && (lexeme.text == "TRUE" || lexeme.text == "FALSE"))
        return true;
      break;
    default:
      break;
    }
  return false;
}

Language language_of(const Sections &sections, const Source &source) {
  bool constants = true;
  for (const Declaration &declaration : sections.declarations) {
    const std::string_view text = trimmed(source.line(declaration.line));
    if (text.find(':') != std::string_view::npos)
      return Language::Structured;
    if (text == "TRUE" || text == "FALSE")
      constants = false;
  }
  for (const std::vector<int> &section : sections.constraints)
    for (const int number : section) {
      const std::vector<Lexeme> line = lex_structured(source.line(number), number);
      if (!is_prefix(line) && is_infix(line, constants))
        return Language::Structured;
    }
  return Language::Slugsin;
}

} // namespace

Language language_of(const Source &source) {
  Diagnostics ignored(source);
  return language_of(read_sections(source, ignored), source);
}

Specification read_specification(const Source &source, Diagnostics &diagnostics) {
  Specification specification;
  specification.file = source.file();
  const Sections sections = read_sections(source, diagnostics);
  const Language language = language_of(sections, source);
  (language == Language::Slugsin ? declare_slugsin : declare_structured)(sections, source, specification,
                                                                         diagnostics);
  const Scope scope(specification);
  for (std::size_t i = 0; i < section_count; ++i) {
    const Section section = static_cast<Section>(i);
    for (const int number : sections.constraints[i]) {
      const std::string_view text = source.line(number);
      const std::vector<Lexeme> line =
          language == Language::Slugsin ? lex_slugsin(text, number) : lex_structured(text, number);
      FormulaPool &pool = specification.formulas;
      const FormulaId formula =
          language == Language::Slugsin ? parse_prefix(line, section, scope, pool, diagnostics)
          : is_prefix(line)             ? parse_prefix(as_prefix(line), section, scope, pool, diagnostics)
                                        : parse_infix(line, section, scope, specification, pool, diagnostics);
      specification[section].push_back({formula, number, std::string(trimmed(text)), false});
    }
  }
  limit_ranges(specification);
  return specification;
}

} // namespace slugs
