// Headings, detection of the language, and the reader of each language.

#include "read/reader.hpp"

#include "read/declarations.hpp"
#include "read/diagnostics.hpp"
#include "read/lexer.hpp"
#include "read/slugsin.hpp"
#include "read/structured.hpp"

#include <cassert>
#include <cstdio>
#include <optional>

namespace slugs {

namespace {

// The kind of section to which the next lines belong.
enum class Part { BeforeFirst, Unknown, Declarations, Constraints };

struct Heading {
  Part part = Part::Unknown;
  Owner owner = Owner::Input;
  Section section = Section::EnvInit;
};

std::optional<Heading> heading(std::string_view name) {
  if (name == "INPUT" || name == "OUTPUT")
    return Heading{Part::Declarations, name == "INPUT" ? Owner::Input : Owner::Output, Section::EnvInit};
  for (std::size_t i = 0; i < section_count; ++i)
    if (name == section_names[i])
      return Heading{Part::Constraints, Owner::Input, static_cast<Section>(i)};
  return std::nullopt;
}

std::vector<std::string> heading_names() {
  std::vector<std::string> names = {"INPUT", "OUTPUT"};
  names.insert(names.end(), section_names.begin(), section_names.end());
  return names;
}

std::string hint_for(const std::string &nearest) {
  if (!nearest.empty())
    return "did you mean [" + nearest + "]?";
  std::string all;
  for (const std::string &known : heading_names())
    all += (all.empty() ? "[" : " [") + known + "]";
  return "the sections are " + all;
}

Heading read_heading(std::string_view line, int number, Diagnostics &diagnostics) {
  const std::string_view text = trimmed(line);
  const int column = static_cast<int>(text.data() - line.data()) + 1;
  assert(!text.empty() && text.front() == '[');
  const std::size_t close = text.find(']');
  if (close == std::string_view::npos) {
    diagnostics.error({number, column + static_cast<int>(text.size()), 1},
                      "found the end of the line, expected ']' after the name of the section");
  } else if (close + 1 < text.size()) {
    diagnostics.error(
        {number, column + static_cast<int>(close) + 1, static_cast<int>(text.size() - close) - 1},
        "found '" + printable(trimmed(text.substr(close + 1))) +
            "' after a section heading, expected the end of the line");
  }
  const std::string_view name =
      trimmed(text.substr(1, close == std::string_view::npos ? std::string_view::npos : close - 1));
  if (const std::optional<Heading> known = heading(name))
    return *known;
  const std::string nearest = nearest_word(name, heading_names());
  diagnostics.error({number, column, static_cast<int>(text.size())},
                    "unknown section [" + printable(name) + "]", hint_for(nearest));
  // Its lines are read as those of the section that was probably meant, so that
  // they cause no errors of their own.
  return heading(nearest).value_or(Heading{});
}

// Return whether a line contains no character on which programs disagree: after one,
// this program's comment may be another's formula.
bool is_one_line(std::string_view line, int number, Diagnostics &diagnostics) {
  for (std::size_t at = 0; at < line.size(); ++at)
    if (const std::size_t length = foreign_length(line.substr(at))) {
      assert(at + length <= line.size() && length <= 3);
      const unsigned last = static_cast<unsigned char>(line[at + length - 1]);
      char name[8];
      std::snprintf(name, sizeof name, "U+%04X", length == 3 ? 0x2000 | (last & 0x3F) : last);
      diagnostics.error({number, static_cast<int>(at) + 1, static_cast<int>(length)},
                        std::string("not text: the character ") + name,
                        "remove it: programs do not agree on whether a line ends there");
      return false;
    }
  return true;
}

} // namespace

Sections read_sections(const Source &source, Diagnostics &diagnostics) {
  Sections sections;
  Heading current{Part::BeforeFirst};
  bool empty = true;
  for (int number = 1; number <= source.line_count(); ++number) {
    const std::string_view line = source.line(number);
    if (!is_one_line(line, number, diagnostics))
      continue;
    const std::string_view text = trimmed(line);
    if (text.empty() || text.front() == '#')
      continue;
    empty = false;
    if (text.front() == '[' && text.substr(0, 2) != "[]") { // else it is an operator of LTL
      current = read_heading(line, number, diagnostics);
      continue;
    }
    switch (current.part) {
    case Part::BeforeFirst:
      diagnostics.error(
          {number, static_cast<int>(text.data() - line.data()) + 1, static_cast<int>(text.size())},
          "found '" + printable(text) + "' before the first section",
          "begin with [INPUT] or [OUTPUT]; a comment starts with '#'");
      break;
    case Part::Unknown:
      break;
    case Part::Declarations:
      sections.declarations.push_back({current.owner, number});
      break;
    case Part::Constraints:
      assert(static_cast<std::size_t>(current.section) < section_count);
      sections.constraints[static_cast<std::size_t>(current.section)].push_back(number);
    }
  }
  if (empty)
    diagnostics.error({}, source.line_count() == 0 ? "the file is empty" : "the file holds no specification",
                      "expected sections such as [INPUT], [OUTPUT] and [SYS_TRANS]");
  return sections;
}

// Detection of the language, and the reader of each language, see
// read/reader.hpp.
//
// Sections may come in any order, so a first pass collects their lines, a
// second declares the variables, and only then formulas are parsed.

namespace {

// Return the first character that is neither blank nor a negation; the "!" of "!="
// is not one.
char first_character(std::string_view line) {
  for (std::size_t i = 0; i < line.size(); ++i)
    if (!is_blank(line[i]) && (line[i] != '!' || line.substr(i, 2) == "!="))
      return line[i];
  return '\0';
}

// Return whether there are only names, numbers, primes and negations, which both languages have.
bool is_plain(std::string_view line) {
  for (const char c : line)
    if (!continues_name(c) && !is_blank(c) && c != '!' && c != '\'')
      return false;
  return line.find("TRUE") == std::string_view::npos && line.find("FALSE") == std::string_view::npos;
}

// Return whether a line is prefix notation: after leading negations it starts with
// an operator that no infix formula can start with.  A line such as "! a" is both.
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

// Return whether a line has what only infix lines have.  `TRUE` is a constant of
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
  specification.formulas = FormulaPool(budget.tuning);
  const Sections sections = read_sections(source, diagnostics);
  budget.check();
  const Language language = language_of(sections, source, pacer);
  (language == Language::Slugsin ? declare_slugsin : declare_structured)(sections, source, specification,
                                                                         diagnostics, pacer);
  assert(diagnostics.error_count() > 0 || specification.integers.empty() || language == Language::Structured);
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
      assert(formula < pool.size());
      specification.add(section, formula, number, trimmed(text), false);
    }
  }
  limit_ranges(specification, pacer);
  for ([[maybe_unused]] const Integer &integer : specification.integers)
    assert(integer.first + integer.bits <= specification.variables.size() || diagnostics.error_count() > 0);
  return specification;
}

} // namespace slugs
