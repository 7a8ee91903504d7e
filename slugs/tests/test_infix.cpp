// Infix formulas: precedence and association by exhaustion, integers against
// plain arithmetic on all values.

#include "expect.hpp"
#include "reading.hpp"

#include <cstdlib>
#include <functional>
#include <random>
#include <vector>

using namespace slugs;

namespace test_infix {
namespace {

struct Connective {
  const char *text;
  int precedence;
  bool (*apply)(bool, bool);
};

const Connective connectives[] = {
    {"&", 5, [](bool a, bool b) { return a && b; }},    {"&&", 5, [](bool a, bool b) { return a && b; }},
    {"/\\", 5, [](bool a, bool b) { return a && b; }},  {"|", 4, [](bool a, bool b) { return a || b; }},
    {"||", 4, [](bool a, bool b) { return a || b; }},   {"\\/", 4, [](bool a, bool b) { return a || b; }},
    {"^", 3, [](bool a, bool b) { return a != b; }},    {"->", 2, [](bool a, bool b) { return !a || b; }},
    {"-->", 2, [](bool a, bool b) { return !a || b; }}, {"<->", 1, [](bool a, bool b) { return a == b; }},
    {"<-->", 1, [](bool a, bool b) { return a == b; }},
};

// a op b op c op d groups by precedence, and to the left among equals.  The
// value is found by applying the tightest, leftmost connective repeatedly,
// which is not how the parser works.
bool grouped(std::vector<bool> values, std::vector<const Connective *> ops) {
  while (!ops.empty()) {
    std::size_t best = 0;
    for (std::size_t i = 1; i < ops.size(); ++i)
      if (ops[i]->precedence > ops[best]->precedence)
        best = i;
    values[best] = ops[best]->apply(values[best], values[best + 1]);
    values.erase(values.begin() + static_cast<std::ptrdiff_t>(best) + 1);
    ops.erase(ops.begin() + static_cast<std::ptrdiff_t>(best));
  }
  return values[0];
}

void test_three_connectives_group_by_precedence_and_to_the_left() {
  for (const Connective &first : connectives)
    for (const Connective &second : connectives)
      for (const Connective &third : connectives) {
        const std::string line =
            std::string("a ") + first.text + " !b" + second.text + "c " + third.text + " ~ d";
        const Specification s = reading::read("[OUTPUT]\na\nb\nc\nd\n[SYS_INIT]\n" + line + "\n");
        for (unsigned v = 0; v < 16; ++v)
          EXPECT_EQ(
              reading::holds(s, reading::only(s, Section::SysInit), v),
              grouped({(v & 1) != 0, (v & 2) == 0, (v & 4) != 0, (v & 8) == 0}, {&first, &second, &third}));
      }
}

// Both lines must be the same formula.
void same(const std::string &one, const std::string &other) {
  const Specification s =
      reading::read("[OUTPUT]\na\nb\nc\nx:0...7\ny:3...9\nX\n[SYS_TRANS]\n" + one + "\n" + other + "\n");
  const std::vector<Constraint> &lines = s[Section::SysTrans];
  if (lines[0].formula != lines[1].formula)
    std::cerr << one << "   and   " << other << '\n';
  EXPECT_EQ(lines[0].formula, lines[1].formula);
}

void test_grouping_and_spellings() {
  same("a & b | c", "(a & b) | c");
  same("a | b & c", "a | (b & c)");
  same("a ^ b | c", "a ^ (b | c)");
  same("a -> b ^ c", "a -> (b ^ c)");
  same("a <-> b -> c", "a <-> (b -> c)");
  same("a -> b -> c", "(a -> b) -> c");
  same("a <-> b <-> c", "(a <-> b) <-> c");
  same("! a & b", "(!a) & b");
  same("! x = 3", "!(x = 3)");
  same("!x<3&a", "(!(x < 3)) & a");
  same("x + y <= 3 + x & b", "((x + y) <= (3 + x)) & b");
  same("next(a & x = 2)", "a' & x' = 2");
  same("X(a) | X", "a' | X");
  same("next(x + y) = 3", "x' + y' = 3");
  same("next(X) & X'", "X'");
  same("a & 1 | 0", "a & TRUE | FALSE");
  same("| & a b c'", "a & b | c'");
  same("||a b&&a b c", "a | b | (a & b & c)");
  same("$ 3 a ^ ? 0 b & ? 1 $ 2 c ? 0", "(a ^ b) & c");
  same("x!=3", "! (x = 3)");
  same("a\t&b", "a & b");
}

// Integers ---------------------------------------------------------------

struct TestVariable {
  const char *name;
  std::int64_t min;
  std::int64_t max;
};

const TestVariable variables[] = {{"p", 0, 3}, {"q", 2, 6}, {"r", 5, 5}, {"s", 1, 2}};
const char *const relations[] = {"=", "!=", "<", "<=", ">", ">="};

bool related(std::int64_t a, int relation, std::int64_t b) {
  const bool results[] = {a == b, a != b, a<b, a <= b, a> b, a >= b};
  return results[relation];
}

struct Term {
  int variable; // -1 for a number
  bool next;
  std::int64_t number;
};

std::vector<Term> random_sum(std::mt19937 &random, std::string &text) {
  std::vector<Term> terms(1 + random() % 6); // often the same variable twice
  for (Term &term : terms) {
    term = {static_cast<int>(random() % 5) - 1, random() % 2 == 0, static_cast<std::int64_t>(random() % 12)};
    if (&term != terms.data())
      text += random() % 2 ? " + " : "+";
    if (term.variable < 0)
      text += std::to_string(term.number);
    else
      text += std::string(variables[term.variable].name) + (term.next ? "'" : "");
  }
  return terms;
}

void test_comparisons_are_those_of_true_integers() {
  std::string header = "[OUTPUT]\n";
  for (const TestVariable &v : variables)
    header += std::string(v.name) + ": " + std::to_string(v.min) + "..." + std::to_string(v.max) + "\n";
  std::mt19937 random(7);
  for (int round = 0; round < 300; ++round) {
    std::string line;
    const std::vector<Term> left = random_sum(random, line);
    const int relation = static_cast<int>(random() % 6);
    line += std::string(" ") + relations[relation] + " ";
    const std::vector<Term> right = random_sum(random, line);
    const Specification s = reading::read(header + "[SYS_LIVENESS]\n" + line + "\n");
    EXPECT_EQ(s.integers.size(), std::size_t{4});
    EXPECT_EQ(s.variables.size(), std::size_t{2 + 3 + 0 + 1});

    // All values of the four variables now, and a random choice of them next.
    for (std::int64_t p = 0; p <= 3; ++p)
      for (std::int64_t q = 2; q <= 6; ++q)
        for (std::int64_t k = 1; k <= 2; ++k) {
          const std::int64_t now[] = {p, q, 5, k};
          std::int64_t next[4];
          std::uint64_t bits[2] = {0, 0};
          for (int i = 0; i < 4; ++i) {
            const auto range = static_cast<unsigned>(variables[i].max - variables[i].min + 1);
            next[i] = variables[i].min + static_cast<std::int64_t>(random() % range);
            const std::uint32_t first = s.integers[static_cast<std::size_t>(i)].first;
            bits[0] |= static_cast<std::uint64_t>(now[i] - variables[i].min) << first;
            bits[1] |= static_cast<std::uint64_t>(next[i] - variables[i].min) << first;
          }
          const auto value = [&](const std::vector<Term> &terms) {
            std::int64_t total = 0;
            for (const Term &term : terms)
              total += term.variable < 0 ? term.number : (term.next ? next : now)[term.variable];
            return total;
          };
          EXPECT_EQ(reading::holds(s, reading::only(s, Section::SysLiveness), bits[0], bits[1]),
                    related(value(left), relation, value(right)));
        }
  }
}

// Each variable is multiplied once, however often it occurs.
void test_a_long_sum_of_few_variables_is_a_small_formula() {
  std::string line = "x + y";
  for (int i = 1; i < 1500; ++i)
    line += i % 2 ? " + (y + x)" : " + x + y";
  const Specification s = reading::read("[OUTPUT]\nx: 0...7\ny: 3...6\n[SYS_TRANS]\n" + line + " = 15000\n");
  EXPECT(s.formulas.size() < 2000);
  const FormulaId formula = reading::only(s, Section::SysTrans);
  for (std::uint64_t x = 0; x <= 7; ++x)
    for (std::uint64_t y = 3; y <= 6; ++y)
      EXPECT_EQ(reading::holds(s, formula, x | (y - 3) << 3), 1500 * x + 1500 * y == 15000);
}

// Sums of many different variables on both sides, with bounds at and next to the value.
void test_sums_of_many_variables_are_those_of_true_integers() {
  std::mt19937 random(11);
  constexpr std::uint32_t count = 24;
  std::string header = "[OUTPUT]\n";
  for (std::uint32_t i = 0; i < count; ++i)
    header += "x" + std::to_string(i) + ": " + std::to_string(i % 3) + "..." +
              std::to_string(i % 3 + (i % 2 ? 1 : 3)) + "\n";
  for (int round = 0; round < 120; ++round) {
    std::uint64_t bits = random();
    bits = bits << 32 | random();
    bits &= (std::uint64_t{1} << count / 2 * 3) - 1;
    std::int64_t sides[2] = {0, 0};
    std::string lines[2] = {"0", "0"};
    const std::uint32_t terms = 10 + random() % 20;
    std::uint32_t place[count];
    for (std::uint32_t i = 0; i < count; ++i)
      place[i] = i / 2 * 3 + (i % 2 ? 2 : 0);
    for (std::uint32_t k = 0; k < terms; ++k) {
      const std::uint32_t i = random() % count;
      const int side = random() % 4 ? 0 : 1;
      lines[side] += "+x" + std::to_string(i);
      sides[side] += i % 3 + static_cast<std::int64_t>((bits >> place[i]) & (i % 2 ? 1 : 3));
    }
    // The difference that makes both sides equal, or nearly so.
    const std::int64_t difference = sides[0] - sides[1] + static_cast<std::int64_t>(random() % 3) - 1;
    lines[difference < 0 ? 0 : 1] += "+" + std::to_string(std::abs(difference));
    sides[difference < 0 ? 0 : 1] += std::abs(difference);
    for (int relation = 0; relation < 6; ++relation) {
      const Specification s =
          reading::read(header + "[SYS_LIVENESS]\n" + lines[0] + relations[relation] + lines[1] + "\n");
      EXPECT_EQ(reading::holds(s, reading::only(s, Section::SysLiveness), bits),
                related(sides[0], relation, sides[1]));
    }
  }
}

void test_large_numbers_do_not_wrap_around() {
  const Specification s = reading::read("[OUTPUT]\nx:0...2147483647\n[SYS_INIT]\n"
                                        "x + x + x + 5 = 2147483647 + 2147483647 + 2147483647 + 5\n");
  EXPECT_EQ(s.variables.size(), std::size_t{31});
  EXPECT(reading::holds(s, reading::only(s, Section::SysInit), 2147483647));
  EXPECT(!reading::holds(s, reading::only(s, Section::SysInit), 2147483646));
}

const expect::Suite suite("test_infix", [] {
  test_three_connectives_group_by_precedence_and_to_the_left();
  test_grouping_and_spellings();
  test_comparisons_are_those_of_true_integers();
  test_a_long_sum_of_few_variables_is_a_small_formula();
  test_sums_of_many_variables_are_those_of_true_integers();
  test_large_numbers_do_not_wrap_around();
});

} // namespace
} // namespace test_infix
