// Declarations of both languages, see read/declarations.hpp.

#include "read/declarations.hpp"

#include "read/lexer.hpp"
#include "read/structured/integers.hpp"
#include "read/structured/ranges.hpp"

#include <algorithm>
#include <deque>
#include <optional>
#include <unordered_map>

namespace slugs {

namespace {

class Declarer {
public:
  Declarer(const Source &source, Specification &specification, Diagnostics &diagnostics, BudgetPacer &pacer,
           std::size_t declarations)
      : source_(source), specification_(specification), diagnostics_(diagnostics), pacer_(pacer) {
    specification_.variables.reserve(declarations);
    lines_.reserve(declarations);
  }

  void slugsin(const Declaration &declaration) {
    pacer_.step();
    const std::string_view line = source_.line(declaration.line);
    const std::string_view text = trimmed(line);
    const Place place{declaration.line, static_cast<int>(text.data() - line.data()) + 1,
                      static_cast<int>(text.size())};
    if (text.find_first_of(" \t\v\f") != std::string_view::npos)
      return diagnostics_.error(place, "found '" + printable(text) + "', expected one name on each line");
    const std::size_t odd = text.find_first_of("!&|^'$?#()=<>+,;");
    // Characters that cannot be shown, such as control characters, are not
    // valid in JSON either.
    if (odd != std::string_view::npos || is_digit(text.front()) || !can_be_shown(text))
      return diagnostics_.error(place, "found '" + printable(text) + "', expected the name of a variable",
                                text.back() == '\'' ? "variables are declared without a prime" : "");
    boolean(text, declaration, place);
  }

  void structured(const Declaration &declaration) {
    const std::vector<Lexeme> lexemes =
        lex_structured(source_.line(declaration.line), declaration.line, pacer_);
    const Lexeme &name = lexemes[0];
    if (name.token != Token::Name)
      return fail(name, "the name of a variable");
    if (name.text == "TRUE" || name.text == "FALSE")
      return diagnostics_.error(name.place, "'" + std::string(name.text) + "' is a constant, not a variable");
    if (lexemes[1].token == Token::End)
      return boolean(name.text, declaration, name.place);
    if (lexemes[1].text != ":") {
      fail(lexemes[1], "':' with a range or the end of the line",
           lexemes[1].token == Token::Prime ? "variables are declared without a prime"
                                            : "declare one variable on each line");
      return boolean(name.text, declaration, name.place);
    }
    // An invalid range declares the widest one, so that uses of the integer are
    // not also reported.
    const std::optional<Range> bounds = range(lexemes);
    integer(name, declaration, bounds.value_or(Range{0, largest_number}));
  }

private:
  void fail(const Lexeme &lexeme, const std::string &expected, const std::string &hint = "") {
    diagnostics_.error(lexeme.place, "found " + describe(lexeme) + ", expected " + expected, hint);
  }

  void boolean(std::string_view name, const Declaration &declaration, Place place) {
    if (fresh(name, place))
      specification_.variables.push_back({std::string(name), declaration.owner, declaration.line});
  }

  struct Range {
    std::int64_t min;
    std::int64_t max;
  };

  // name : min ... max
  std::optional<Range> range(const std::vector<Lexeme> &lexemes) {
    static constexpr const char *form = "an integer is declared as x:0...7";
    std::size_t at = 2;
    const std::optional<std::int64_t> min = bound(lexemes, at);
    if (!min)
      return std::nullopt;
    if (lexemes[at].text != "...") {
      fail(lexemes[at], "'...' between the bounds of the range", form);
      return std::nullopt;
    }
    ++at;
    const std::optional<std::int64_t> max = bound(lexemes, at);
    if (!max)
      return std::nullopt;
    if (lexemes[at].token != Token::End) {
      fail(lexemes[at], "the end of the line", form);
      return std::nullopt;
    }
    if (*min <= *max)
      return Range{*min, *max};
    const Place first = lexemes[2].place;
    const Place last = lexemes[at - 1].place;
    diagnostics_.error({first.line, first.column, last.column + last.length - first.column},
                       "the range " + std::to_string(*min) + "..." + std::to_string(*max) + " is empty",
                       "the smaller bound comes first");
    return std::nullopt;
  }

  std::optional<std::int64_t> bound(const std::vector<Lexeme> &lexemes, std::size_t &at) {
    const Lexeme &lexeme = lexemes[at];
    if (lexeme.text == "-") {
      fail(lexeme, "a number from 0", "negative numbers are not supported: shift the range");
      return std::nullopt;
    }
    if (lexeme.token != Token::Number) {
      fail(lexeme, "a number", "an integer is declared as x:0...7");
      return std::nullopt;
    }
    ++at;
    const std::optional<std::int64_t> number = parse_number(lexeme.text);
    if (!number)
      diagnostics_.error(lexeme.place, out_of_range_message(lexeme.text));
    return number;
  }

  void integer(const Lexeme &name, const Declaration &declaration, Range range) {
    if (!fresh(name.text, name.place))
      return;
    const Integer integer{std::string(name.text),
                          declaration.owner,
                          range.min,
                          range.max,
                          static_cast<std::uint32_t>(specification_.variables.size()),
                          width(static_cast<std::uint64_t>(range.max - range.min)),
                          declaration.line};
    for (std::uint32_t bit = 0; bit < integer.bits; ++bit) {
      pacer_.step();
      const std::string &bit_text = bit_names_.emplace_back(bit_name(integer, bit));
      if (fresh(bit_text, name.place))
        specification_.variables.push_back({bit_text, integer.owner, integer.line});
    }
    specification_.integers.push_back(integer);
  }

  static bool can_be_shown(std::string_view text) {
    const bool plain = std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c <= '~'; });
    return plain || printable(text, text.size()) == text;
  }

  bool fresh(std::string_view name, Place place) {
    const auto [known, inserted] = lines_.try_emplace(name, place.line);
    if (!inserted)
      diagnostics_.error(place, "variable '" + printable(name) + "' is declared twice",
                         "first declared in line " + std::to_string(known->second));
    return inserted;
  }

  const Source &source_;
  Specification &specification_;
  Diagnostics &diagnostics_;
  BudgetPacer &pacer_;
  std::unordered_map<std::string_view, int> lines_; // of names in the source or below
  std::deque<std::string> bit_names_;
};

} // namespace

void declare_slugsin(const Sections &sections, const Source &source, Specification &specification,
                     Diagnostics &diagnostics, BudgetPacer &pacer) {
  Declarer declarer(source, specification, diagnostics, pacer, sections.declarations.size());
  for (const Declaration &declaration : sections.declarations)
    declarer.slugsin(declaration);
}

void declare_structured(const Sections &sections, const Source &source, Specification &specification,
                        Diagnostics &diagnostics, BudgetPacer &pacer) {
  Declarer declarer(source, specification, diagnostics, pacer, sections.declarations.size());
  for (const Owner owner : {Owner::Input, Owner::Output})
    for (const Declaration &declaration : sections.declarations)
      if (declaration.owner == owner)
        declarer.structured(declaration);
}

void limit_ranges(Specification &specification, BudgetPacer &pacer) {
  FormulaPool &pool = specification.formulas;
  for (const Integer &integer : specification.integers) {
    if (!needs_limit(integer))
      continue;
    const auto limit = [&](bool next) {
      std::vector<FormulaId> bits;
      for (std::uint32_t bit = 0; bit < integer.bits; ++bit) {
        pacer.step();
        bits.push_back(pool.variable(integer.first + bit, next));
      }
      const FormulaId above = less(pool, {integer.max - integer.min, {}}, bit_vector(std::move(bits)));
      return pool.negation(above);
    };
    const bool input = integer.owner == Owner::Input;
    const std::string text = integer.name + ":" + range_text(integer);
    const FormulaId now = limit(false), next = limit(true);
    specification.add(input ? Section::EnvInit : Section::SysInit, now, integer.line, text, true);
    specification.add(input ? Section::EnvTrans : Section::SysTrans, next, integer.line, text, true);
  }
}

} // namespace slugs
