// Formulas, the readers of both languages, and the translation: what translate() prints is
// slugsin for the same game.

#include "core/formula.hpp"
#include "expect.hpp"
#include "read/declarations.hpp"
#include "read/slugsin.hpp"
#include "reading.hpp"

#include <atomic>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

using namespace slugs;

namespace test_readers {
namespace {

std::string names(const Specification &specification) {
  std::string text;
  for (const Variable &variable : specification.variables)
    text += (text.empty() ? "" : " ") + variable.name + (variable.owner == Owner::Input ? "/i" : "/o");
  return text;
}

Language language(const std::string &text) { return language_of(Source("test", text)); }

void test_slugsin_keeps_the_order_of_the_file() {
  const Specification s = reading::read("[OUTPUT]\nb\n[INPUT]\na\n[OUTPUT]\nc\n[INPUT]\nd\n");
  EXPECT_EQ(names(s), "b/o a/i c/o d/i");
  EXPECT_EQ(s.variables[2].line, 6);
}

void test_structuredslugs_has_inputs_first() {
  const Specification s = reading::read("[OUTPUT]\nb\ni:1...4\n[INPUT]\nj:3...3\nk: 0 ... 5\na\n");
  EXPECT_EQ(names(s), "k@0.0.5/i k@1/i k@2/i a/i b/o i@0.1.4/o i@1/o");
  EXPECT_EQ(s.integers.size(), std::size_t{3});
  EXPECT_EQ(s.integers[0].name, "j");
  EXPECT_EQ(s.integers[0].bits, 0u);
  EXPECT_EQ(s.integers[1].first, 0u);
  EXPECT_EQ(s.integers[1].bits, 3u);
  EXPECT_EQ(s.integers[2].first, 5u);
  EXPECT_EQ(s.integers[2].line, 3);
}

void test_range_limits_only_where_bits_can_exceed_the_range() {
  const Specification s = reading::read("[INPUT]\nk:0...5\nfull:2...5\none:7...7\n[OUTPUT]\nm:1...3\n");
  EXPECT_EQ(s[Section::EnvInit].size(), std::size_t{1});
  EXPECT_EQ(s[Section::EnvTrans].size(), std::size_t{1});
  EXPECT_EQ(s[Section::SysInit].size(), std::size_t{1});
  EXPECT_EQ(s[Section::SysTrans].size(), std::size_t{1});
  const Constraint &limit = s[Section::EnvTrans][0];
  EXPECT(limit.range_limit);
  EXPECT_EQ(s.text(limit), "k:0...5");
  EXPECT_EQ(limit.line, 2);
  for (unsigned value = 0; value < 8; ++value) {
    EXPECT_EQ(reading::holds(s, s[Section::EnvInit][0].formula, value, 7 - value), value <= 5);
    EXPECT_EQ(reading::holds(s, limit.formula, 7 - value, value), value <= 5);
  }
  for (unsigned value = 0; value < 4; ++value)
    EXPECT_EQ(reading::holds(s, s[Section::SysTrans][0].formula, 0, value << 5), value + 1 <= 3);
}

void test_sections_repeat_and_keep_text_and_line() {
  const Specification s =
      reading::read("# a comment\n[SYS_TRANS]\n  a' \n[OUTPUT]\na\n\n  # another\n[SYS_TRANS]\r\n"
                    "| a a'\r\n[SYS_LIVENESS]\na\n! a\n");
  EXPECT_EQ(s[Section::SysTrans].size(), std::size_t{2});
  EXPECT_EQ(s.text(s[Section::SysTrans][0]), "a'");
  EXPECT_EQ(s[Section::SysTrans][0].line, 3);
  EXPECT_EQ(s.text(s[Section::SysTrans][1]), "| a a'");
  EXPECT_EQ(s[Section::SysTrans][1].line, 9);
  EXPECT_EQ(s[Section::SysLiveness].size(), std::size_t{2});
  EXPECT_EQ(s.file, "test");
}

void test_a_line_ends_at_a_line_feed_alone() {
  const char *const separators[] = {"\r",       "\v",           "\f",   "\x1C",
                                    "\xC2\x85", "\xE2\x80\xA8", "\x7F", "\xE2\x80\xA9"};
  for (const std::string separator : separators)
    for (const char *const rest : {"# a comment", "a"}) {
      const std::string text = "[OUTPUT]\na\n[SYS_TRANS]\n" + (rest + separator) + "! a\n";
      const Source source("test", text);
      Diagnostics diagnostics(source);
      const Specification s = read_specification(source, diagnostics);
      EXPECT_EQ(diagnostics.error_count(), std::size_t{1});
      EXPECT(s[Section::SysTrans].empty());
      EXPECT(diagnostics.sorted()[0].message.find("not text: the character U+") == 0);
    }
  EXPECT_EQ(
      reading::read("[OUTPUT]\r\na\r\n[SYS_TRANS]\r\n# \xC3\x85\xE2\x80\x99\t\r\na\t\r\n")[Section::SysTrans]
          .size(),
      std::size_t{1});
}

void test_languages_are_recognized_by_content() {
  EXPECT(language("[OUTPUT]\na\n[SYS_INIT]\n! a\n") == Language::Slugsin);
  EXPECT(language("[OUTPUT]\na\n[SYS_INIT]\n| a ! a'\n") == Language::Slugsin);
  EXPECT(language("[OUTPUT]\na\n[SYS_INIT]\n!! & a a\n") == Language::Slugsin);
  EXPECT(language("[OUTPUT]\na@0.0.3\na-b\n[SYS_INIT]\n$ 2 a@0.0.3 ? 0\n") == Language::Slugsin);
  EXPECT(language("[OUTPUT]\nTRUE\n[SYS_INIT]\nTRUE\n") == Language::Slugsin);
  EXPECT(language("[OUTPUT]\na\n[SYS_INIT]\nTRUE\n") == Language::Structured);
  EXPECT(language("[OUTPUT]\na\n[SYS_INIT]\na & a\n") == Language::Structured);
  EXPECT(language("[OUTPUT]\na\n[SYS_INIT]\n(a)\n") == Language::Structured);
  EXPECT(language("[OUTPUT]\na\n[SYS_INIT]\n~a\n") == Language::Structured);
  EXPECT(language("[OUTPUT]\nx:0...1\n[SYS_INIT]\n| a a\n") == Language::Structured);
  EXPECT(language("# a & b\n[OUTPUT]\na\n") == Language::Slugsin);
}

void test_buffers_nest_and_may_use_earlier_entries() {
  // The value of a buffer is its last entry; the inner one hides the outer.
  const Specification s = reading::read("[OUTPUT]\na\nb\nc\n[SYS_INIT]\n"
                                        "& $ 3 ^ a b & ? 0 c | ? 1 ! ? 0 $ 2 $ 1 b & ? 0 1\n");
  for (unsigned v = 0; v < 8; ++v) {
    const bool a = v & 1, b = v & 2, c = v & 4;
    const bool first = a != b, second = first && c;
    EXPECT_EQ(reading::holds(s, reading::only(s, Section::SysInit), v), (second || !first) && b);
  }
}

void test_what_each_section_may_use() {
  const auto allowed = [](const char *section, const char *line) {
    const std::string text = std::string("[INPUT]\ni\n[OUTPUT]\no\n[") + section + "]\n" + line + "\n";
    const Source source("test", text);
    Diagnostics diagnostics(source);
    read_specification(source, diagnostics);
    return diagnostics.error_count() == 0;
  };
  const char *const uses[] = {"i", "o", "i'", "o'"};
  const struct {
    const char *section;
    bool may[4];
  } rules[] = {
      {"ENV_INIT", {true, false, false, false}},  {"SYS_INIT", {true, true, false, false}},
      {"ENV_TRANS", {true, true, true, false}},   {"SYS_TRANS", {true, true, true, true}},
      {"ENV_LIVENESS", {true, true, true, true}}, {"SYS_LIVENESS", {true, true, true, true}},
  };
  for (const auto &rule : rules)
    for (int k = 0; k < 4; ++k) {
      EXPECT_EQ(allowed(rule.section, uses[k]), rule.may[k]);
      EXPECT_EQ(allowed(rule.section, (std::string("TRUE & ") + uses[k]).c_str()), rule.may[k]);
    }
}

// Thousands of declarations take time before the first constraint is read.
void test_declarations_look_at_the_limits() {
  std::string text = "[OUTPUT]\n";
  for (int i = 0; i < 3000; ++i)
    text += "x" + std::to_string(i) + ":0...2\n";
  const Source source("test", text);
  Diagnostics diagnostics(source);
  const Sections sections = read_sections(source, diagnostics);
  const std::atomic<bool> interrupted{true};
  Budget spent;
  spent.interrupted = &interrupted;
  const auto stops = [](auto work) {
    try {
      work();
      return false;
    } catch (const LimitReached &) {
      return true;
    }
  };
  BudgetPacer pacer(spent), other(spent), unlimited{Budget()};
  Specification none, all;
  EXPECT(stops([&] { declare_structured(sections, source, none, diagnostics, pacer); }));
  EXPECT(!stops([&] { declare_structured(sections, source, all, diagnostics, unlimited); }));
  EXPECT_EQ(all.integers.size(), std::size_t{3000});
  EXPECT(stops([&] { limit_ranges(all, other); }));
}

} // namespace

namespace {

constexpr std::uint32_t variables = 1000;

FormulaId pair(FormulaPool &pool, std::uint32_t i) {
  const FormulaId now = pool.variable(i % variables, false);
  return pool.conjunction(now, pool.variable(i / variables, true));
}

void equal_formulas_are_one() {
  FormulaPool pool;
  const FormulaId a = pool.variable(0, false), b = pool.variable(1, true);
  EXPECT(pool.variable(0, true) != a);
  EXPECT_EQ(pool.conjunction(a, b), pool.conjunction(b, a));
  EXPECT_EQ(pool.conjunction(a, pool.conjunction(a, b)), pool.conjunction(a, b));
  EXPECT_EQ(pool.negation(pool.negation(pool.exclusive_or(a, b))), pool.exclusive_or(a, b));
  EXPECT_EQ(pool.disjunction(a, pool.constant(true)), pool.constant(true));
}

// Operators beyond what is remembered; variables are always.
void a_very_large_pool_remembers_what_is_recent() {
  constexpr std::uint32_t count = 900000;
  FormulaPool pool;
  std::vector<FormulaId> first;
  for (std::uint32_t i = 0; i < count; ++i)
    first.push_back(pair(pool, i));
  EXPECT(pair(pool, 0) != first[0]);
  EXPECT_EQ(pair(pool, count - 1), first[count - 1]);
  EXPECT_EQ(pool.variable(0, false), pool[first[0]].left);
  bool operands_first = true, as_made = true;
  for (std::uint32_t i = 0; i < count; ++i) {
    const FormulaNode &node = pool[first[i]];
    operands_first = operands_first && node.left < first[i] && node.right < first[i];
    const FormulaNode &x = pool[node.left], &y = pool[node.right];
    const FormulaNode &now = x.right ? y : x, &next = x.right ? x : y;
    as_made = as_made && !now.right && now.left == i % variables && next.left == i / variables;
  }
  EXPECT(operands_first);
  EXPECT(as_made);
}

} // namespace

namespace {

const char *const header = "[OUTPUT]\nb\nspeed:3...7\n[INPUT]\na\nx:0...5\n";

// A random infix formula over inputs and outputs, now and next.
std::string formula(std::mt19937 &random, int depth) {
  static const char *const atoms[] = {
      "a", "b'", "x = 3", "x' <= speed", "speed' + x >= 8", "speed' != x + 2", "a'", "TRUE"};
  static const char *const operators[] = {" & ", " | ", " ^ ", " -> ", " <-> "};
  if (depth == 0 || random() % 5 == 0)
    return atoms[random() % 8];
  const std::string left = formula(random, depth - 1);
  const std::string op = operators[random() % 5];
  return (random() % 3 == 0 ? "!(" : "(") + left + op + formula(random, depth - 1) + ")";
}

void test_round_trip() {
  std::mt19937 random(11);
  for (int round = 0; round < 60; ++round) {
    std::string text = header;
    for (const char *section : {"SYS_TRANS", "SYS_LIVENESS", "ENV_LIVENESS"}) {
      text += std::string("[") + section + "]\n";
      for (unsigned lines = random() % 4; lines > 0; --lines)
        text += formula(random, 4) + "\n";
    }
    const Specification original = reading::read(text);
    std::ostringstream printed;
    translate(original, printed);
    EXPECT(language_of(Source("printed", printed.str())) == Language::Slugsin);
    const Specification copy = reading::read(printed.str());

    EXPECT_EQ(copy.variables.size(), original.variables.size());
    for (std::size_t i = 0; i < original.variables.size(); ++i) {
      EXPECT_EQ(copy.variables[i].name, original.variables[i].name);
      EXPECT(copy.variables[i].owner == original.variables[i].owner);
    }
    for (std::size_t section = 0; section < section_count; ++section) {
      EXPECT_EQ(copy.constraints[section].size(), original.constraints[section].size());
      for (std::size_t k = 0; k < original.constraints[section].size(); ++k) {
        const FormulaId printed_id = copy.constraints[section][k].formula;
        const FormulaId id = original.constraints[section][k].formula;
        for (int sample = 0; sample < 40; ++sample) {
          const std::uint64_t now = random(), next = random();
          EXPECT_EQ(reading::holds(copy, printed_id, now, next), reading::holds(original, id, now, next));
        }
      }
    }
  }
}

void test_shared_formulas_are_written_once() {
  // Twenty levels, each using the one below twice: as a tree, 2^20 copies of the lowest.
  std::string line = "$ 21 ^ a b";
  for (int i = 0; i < 20; ++i)
    line += " & | ? " + std::to_string(i) + " a ^ ? " + std::to_string(i) + " b";
  const Specification s = reading::read("[OUTPUT]\na\nb\n[SYS_INIT]\n" + line + "\n");
  std::ostringstream printed;
  translate(s, printed);
  EXPECT(printed.str().size() < 2000);
  const Specification copy = reading::read(printed.str());
  for (unsigned v = 0; v < 4; ++v)
    EXPECT_EQ(reading::holds(copy, reading::only(copy, Section::SysInit), v),
              reading::holds(s, reading::only(s, Section::SysInit), v));
}

// An integer of one value has no bits, so a specification may become empty.
void test_what_says_nothing_is_read_again() {
  for (const std::string lines : {"", "[SYS_LIVENESS]\none = 4\n"}) {
    std::ostringstream printed;
    translate(reading::read("[OUTPUT]\none:4...4\n" + lines), printed);
    EXPECT_EQ(reading::read(printed.str()).variables.size(), std::size_t{0});
  }
}

const expect::Suite suite("test_readers", [] {
  test_slugsin_keeps_the_order_of_the_file();
  test_structuredslugs_has_inputs_first();
  test_range_limits_only_where_bits_can_exceed_the_range();
  test_sections_repeat_and_keep_text_and_line();
  test_a_line_ends_at_a_line_feed_alone();
  test_languages_are_recognized_by_content();
  test_buffers_nest_and_may_use_earlier_entries();
  test_what_each_section_may_use();
  test_declarations_look_at_the_limits();
  equal_formulas_are_one();
  a_very_large_pool_remembers_what_is_recent();
  test_round_trip();
  test_shared_formulas_are_written_once();
  test_what_says_nothing_is_read_again();
});

} // namespace
} // namespace test_readers
