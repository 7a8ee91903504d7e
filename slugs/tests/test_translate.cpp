// What translate() prints is slugsin for the same game: the same variables in
// the same order, and in each section formulas that agree everywhere.

#include "expect.hpp"
#include "read/slugsin/translate.hpp"
#include "reading.hpp"

#include <random>

using namespace slugs;

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
  // Twenty levels, each using the one below twice: 2^20 times as a tree.
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

} // namespace

int main() {
  return expect::run([] {
    test_round_trip();
    test_shared_formulas_are_written_once();
    test_what_says_nothing_is_read_again();
  });
}
