// Numbers and bits of integers, name lookup with the rules of the sections, and the
// declarations of both languages.

#include "read/declarations.hpp"

#include "core/hash.hpp"
#include "read/diagnostics.hpp"
#include "read/lexer.hpp"
#include "read/values.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <deque>
#include <optional>
#include <unordered_map>

namespace slugs {

std::optional<std::int64_t> parse_number(std::string_view digits) {
  std::int64_t number = 0;
  for (const char digit : digits) {
    assert(is_digit(digit));
    number = 10 * number + (digit - '0');
    if (number > largest_number)
      return std::nullopt;
  }
  return number;
}

std::string out_of_range_message(std::string_view digits) {
  return "number " + printable(digits, 20) + " is out of range: the largest is " +
         std::to_string(largest_number);
}

std::string range_text(const Integer &integer) {
  return std::to_string(integer.min) + "..." + std::to_string(integer.max);
}

std::string bit_name(const Integer &integer, std::uint32_t bit) {
  assert(bit < integer.bits);
  std::string name = integer.name + "@" + std::to_string(bit);
  if (bit == 0)
    name += "." + std::to_string(integer.min) + "." + std::to_string(integer.max);
  return name;
}

bool needs_limit(const Integer &integer) {
  assert(integer.min >= 0 && integer.min <= integer.max && integer.max <= largest_number);
  assert((std::int64_t{1} << integer.bits) > integer.max - integer.min);
  return (std::int64_t{1} << integer.bits) != integer.max - integer.min + 1;
}

namespace {

constexpr std::size_t most_short = 7; // bytes of a name that is its own key

// The key of a short name is the name with its length; that of a longer one is a hash,
// which is not the key of a short name.  Eight bytes at a time; pieces may overlap.
std::uint64_t key_of(std::string_view name) {
  const char *at = name.data();
  const std::size_t length = name.size();
  if (length <= most_short) {
    std::uint32_t first = 0, last = 0;
    if (length >= sizeof first) {
      std::memcpy(&first, at, sizeof first);
      std::memcpy(&last, at + length - sizeof last, sizeof last);
    } else {
      for (const char c : name)
        first = first << 8 | static_cast<unsigned char>(c);
    }
    // The new ones of the last four bytes, at most three, depending on the length.
    const std::uint64_t rest =
        length > sizeof first ? std::uint64_t{last} >> 8 * (2 * sizeof first - length) : 0;
    return std::uint64_t{length} << 56 | rest << 32 | first;
  }
  std::uint64_t h = length, word = 0;
  for (std::size_t i = 0; i + sizeof word < length; i += sizeof word) {
    std::memcpy(&word, at + i, sizeof word);
    h = (h ^ word) * golden_multiplier;
    h ^= h >> 32;
  }
  std::memcpy(&word, at + length - sizeof word, sizeof word);
  h = (h ^ word) * golden_multiplier;
  h ^= h >> 32;
  return h * second_multiplier | std::uint64_t{most_short + 1} << 56;
}

} // namespace

bool may_use(Section section, Owner owner, bool next) {
  switch (section) {
  case Section::EnvInit:
    return owner == Owner::Input && !next;
  case Section::SysInit:
    return !next;
  case Section::EnvTrans:
    return owner == Owner::Input || !next;
  default:
    return true;
  }
}

Scope::Scope(const Specification &specification) : specification_(specification) {
  std::size_t size = 16;
  while (size < 2 * (specification.integers.size() + specification.variables.size()))
    size *= 2;
  assert((size & (size - 1)) == 0);
  symbols_.resize(size);
  for (std::uint32_t i = 0; i < specification.integers.size(); ++i)
    add(Symbol{i, true, specification.integers[i].owner});
  for (std::uint32_t i = 0; i < specification.variables.size(); ++i)
    add(Symbol{i, false, specification.variables[i].owner});
}

const std::string &Scope::name(const Symbol &symbol) const {
  return symbol.integer ? specification_.integers[symbol.index].name
                        : specification_.variables[symbol.index].name;
}

// Return the slot of the name, or the empty slot for it.
std::size_t Scope::slot_of(std::string_view name, std::uint64_t key) const {
  const std::size_t last = symbols_.size() - 1;
  assert((symbols_.size() & last) == 0 && key != 0);
  for (std::size_t place = static_cast<std::size_t>(key * golden_multiplier >> 32) & last;;
       place = (place + 1) & last) {
    const Entry &entry = symbols_[place];
    if (!entry.key || (entry.key == key && (name.size() <= most_short || this->name(entry.symbol) == name)))
      return place;
  }
}

// The first declaration counts.
void Scope::add(Symbol symbol) {
  assert(symbol.index < (symbol.integer ? specification_.integers.size() : specification_.variables.size()));
  const std::uint64_t key = key_of(name(symbol));
  Entry &entry = symbols_[slot_of(name(symbol), key)];
  if (!entry.key)
    entry = {key, symbol};
  assert(find(name(symbol)));
}

const Symbol *Scope::find(std::string_view name) const {
  const std::uint64_t key = key_of(name);
  const Entry &entry = symbols_[slot_of(name, key)];
  assert(!entry.key || this->name(entry.symbol) == name);
  return entry.key ? &entry.symbol : nullptr;
}

const std::vector<std::string> &Scope::names() const {
  if (!names_.empty())
    return names_;
  for (const Integer &integer : specification_.integers)
    names_.push_back(integer.name);
  for (const Variable &variable : specification_.variables)
    if (specification_.integers.empty() || variable.name.find('@') == std::string::npos)
      names_.push_back(variable.name);
  return names_;
}

bool Scope::check_use(const Symbol &symbol, std::string_view name, Place place, Section section, bool next,
                      Diagnostics &diagnostics) const {
  if (may_use(section, symbol.owner, next))
    return true;
  assert(section != Section::SysTrans && section != Section::EnvLiveness && section != Section::SysLiveness);
  const char *hint = "";
  if (section == Section::EnvInit && !next)
    hint = "ENV_INIT refers to inputs only; SYS_INIT may use outputs and inputs";
  else if (section == Section::EnvInit)
    hint = "ENV_INIT refers to current inputs; how they may change belongs in ENV_TRANS";
  else if (section == Section::SysInit)
    hint = "SYS_INIT refers to current values; what must hold of next values belongs in SYS_TRANS";
  else
    hint = "the environment moves first: ENV_TRANS may use current values and next inputs";
  diagnostics.error(place,
                    std::string(next ? "the next value of " : "") +
                        (symbol.owner == Owner::Input ? "input '" : "output '") + printable(name) +
                        "' is not allowed in " + section_names[static_cast<std::size_t>(section)],
                    hint);
  return false;
}

void Scope::report_undeclared(std::string_view name, Place place, const std::string &hint,
                              Diagnostics &diagnostics) const {
  const auto [known, fresh] = nearest_.try_emplace(std::string(name));
  if (fresh)
    known->second = nearest_word(name, names());
  diagnostics.error(place, "undeclared variable '" + printable(name) + "'",
                    known->second.empty() ? hint : "did you mean '" + printable(known->second) + "'?");
}

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
    assert(!text.empty());
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
    assert(lexemes.size() >= 2 && lexemes.back().token == Token::End);
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
    assert(at < lexemes.size());
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
    assert(integer.min + (std::int64_t{1} << integer.bits) > integer.max);
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
    assert(now > 1 && next > 1 && now != next);
    specification.add(input ? Section::EnvInit : Section::SysInit, now, integer.line, text, true);
    specification.add(input ? Section::EnvTrans : Section::SysTrans, next, integer.line, text, true);
  }
}

} // namespace slugs
