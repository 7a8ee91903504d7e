// Detection of the language, and the reader of each language, see
// read/reader.hpp.
//
// Sections may come in any order, so a first pass collects their lines, a
// second declares the variables, and only then formulas are parsed.

#include "read/reader.hpp"

#include "read/declarations.hpp"
#include "read/lexer.hpp"
#include "read/sections.hpp"
#include "read/slugsin/parser_prefix.hpp"
#include "read/structured/parser_infix.hpp"

namespace slugs {

namespace {

// The first character that is neither blank nor a negation; the "!" of "!=" is
// not one.
char first_character(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i)
    if (!is_blank(line[i]) && (line[i] != '!' || line.substr(i, 2) == "!="))
      return line[i];
  return '\0';
}

// Whether there are only names, numbers, primes and negations, which both languages have.
bool is_plain(std::string_view line) {
  for (const char c : line)
    if (!continues_name(c) && !is_blank(c) && c != '!' && c != '\'')
      return false;
  return line.find("TRUE") == std::string_view::npos && line.find("FALSE") == std::string_view::npos;
}

// Whether a line is prefix notation: behind leading negations it starts with an
// operator that no infix formula can start with.  A line such as "! a" is both.
bool is_prefix(Lexer line) {
  while (line.peek().token == Token::Not)
    line.take();
  switch (line.peek().token) {
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

// Whether a line has what only infix lines have.  `TRUE` is a constant of
// structuredslugs, unless it is the name of a variable.
bool is_infix(Lexer line, bool constants) {
  for (Lexeme lexeme = line.take(); lexeme.token != Token::End; lexeme = line.take())
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

Language language_of(const Sections &sections, const Source &source, BudgetPacer &pacer) {
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
      // Most lines of long files are classified without a lexer.
      pacer.step();
      const std::string_view text = source.line(number);
      if (std::string_view("&|^$?").find(first_character(text)) != std::string_view::npos || is_plain(text))
        continue;
      const Lexer line(text, number, Words::Structured, pacer);
      if (!is_prefix(line) && is_infix(line, constants))
        return Language::Structured;
    }
  return Language::Slugsin;
}

} // namespace

Language language_of(const Source &source) {
  Diagnostics ignored(source);
  BudgetPacer unlimited{Budget()};
  return language_of(read_sections(source, ignored), source, unlimited);
}

Specification read_specification(const Source &source, Diagnostics &diagnostics, const Budget &budget) {
  BudgetPacer pacer(budget);
  budget.check();
  Specification specification;
  specification.file = source.file();
  const Sections sections = read_sections(source, diagnostics);
  budget.check();
  const Language language = language_of(sections, source, pacer);
  (language == Language::Slugsin ? declare_slugsin : declare_structured)(sections, source, specification,
                                                                         diagnostics, pacer);
  const Scope scope(specification);
  FormulaPool &pool = specification.formulas;
  PrefixParser prefix(scope, pool, diagnostics);
  for (std::size_t i = 0; i < section_count; ++i) {
    const Section section = static_cast<Section>(i);
    specification[section].reserve(sections.constraints[i].size());
    for (const int number : sections.constraints[i]) {
      const std::string_view text = source.line(number);
      const auto lexer = [&](Words words) { return Lexer(text, number, words, pacer); };
      FormulaId formula;
      if (language == Language::Slugsin || is_prefix(lexer(Words::Structured))) {
        Lexer line = lexer(language == Language::Slugsin ? Words::Slugsin : Words::StructuredPrefix);
        formula = prefix.parse(line, section);
      } else {
        Lexer line = lexer(Words::Structured);
        formula = parse_infix(line, section, scope, specification, pool, diagnostics);
      }
      specification.add(section, formula, number, trimmed(text), false);
    }
  }
  limit_ranges(specification, pacer);
  return specification;
}

} // namespace slugs
