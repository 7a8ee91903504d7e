// The checker's search for moves without an answer, against trying all moves
// and answers, and on a game with far too many moves to try.

#include "certificate/moves/dead_end.hpp"
#include "expect.hpp"
#include "reading.hpp"

#include <algorithm>
#include <random>
#include <vector>

using namespace slugs;

namespace {

constexpr unsigned inputs = 4, outputs = 3, bits = inputs + outputs;

// Prefix notation over v0 .. v6; next values below `next_below` only.
std::string formula(std::mt19937 &random, int depth, unsigned next_below) {
  if (depth == 0 || random() % 6 == 0) {
    const unsigned v = random() % bits;
    return (random() % 2 ? "! v" : "v") + std::to_string(v) + (v < next_below && random() % 4 ? "'" : "");
  }
  static const char *const operators[] = {"& ", "| ", "| ", "^ ", "! ^ "};
  const std::string op = operators[random() % 5];
  const std::string left = formula(random, depth - 1, next_below);
  return op + left + " " + formula(random, depth - 1, next_below);
}

std::vector<OpenVariable> variables(unsigned from, unsigned to) {
  std::vector<OpenVariable> result;
  for (unsigned v = from; v < to; ++v)
    result.push_back({v, true});
  return result;
}

using Values = std::vector<reading::Value>;

Values values(const Specification &s, Section section) {
  Values result;
  for (const Constraint &constraint : s[section])
    result.emplace_back(s, constraint.formula);
  return result;
}

bool all_hold(Values &constraints, std::uint64_t now, std::uint64_t next) {
  return std::all_of(constraints.begin(), constraints.end(), [&](reading::Value &v) { return v(now, next); });
}

DeadEnds::Kind by_trial(const Specification &s, std::uint64_t now) {
  Values assumptions = values(s, Section::EnvTrans), guarantees = values(s, Section::SysTrans);
  bool moves = false;
  for (std::uint64_t move = 0; move < 1u << inputs; ++move) {
    if (!all_hold(assumptions, now, move))
      continue;
    moves = true;
    bool answered = false;
    for (std::uint64_t answer = 0; answer < 1u << outputs && !answered; ++answer)
      answered = all_hold(guarantees, now, move | answer << inputs);
    if (!answered)
      return DeadEnds::Kind::SystemStuck;
  }
  return moves ? DeadEnds::Kind::None : DeadEnds::Kind::EnvironmentStuck;
}

void test_random_games() {
  std::mt19937 random(31);
  const Budget budget;
  int kinds[3] = {0, 0, 0};
  for (int round = 0; round < 300; ++round) {
    std::string text;
    for (unsigned v = 0; v < bits; ++v)
      text += (v < inputs ? "[INPUT]\nv" : "[OUTPUT]\nv") + std::to_string(v) + "\n";
    text += "[ENV_TRANS]\n";
    for (unsigned lines = random() % 3; lines > 0; --lines)
      text += formula(random, 3, inputs) + "\n";
    text += "[SYS_TRANS]\n";
    for (unsigned lines = 1 + random() % 4; lines > 0; --lines)
      text += formula(random, 3, bits) + "\n";
    const Specification s = reading::read(text);
    DeadEnds dead_ends(s, Section::EnvTrans, Section::SysTrans, variables(0, inputs), variables(inputs, bits),
                       budget);
    for (int sample = 0; sample < 4; ++sample) {
      const std::uint64_t now = random() % (1u << bits);
      Assignment assignment(bits);
      for (unsigned v = 0; v < bits; ++v)
        assignment.current[v] = known((now >> v) & 1);
      const DeadEnds::Kind found = dead_ends.search(assignment);
      EXPECT_EQ(found, by_trial(s, now));
      ++kinds[static_cast<int>(found)];
    }
  }
  for (const int count : kinds)
    EXPECT(count > 20);
}

// Forty free inputs; the system can follow three integers, but not to their sum.
void test_many_moves() {
  const std::string text =
      "[INPUT]\nx:0...4095\ny:0...4095\nz:0...4095\na\nb\nc\nd\n[OUTPUT]\nw:0...4095\nv\n"
      "[ENV_TRANS]\nx' <= y' + 7\n[SYS_TRANS]\n";
  const auto search = [&](const std::string &guarantee) {
    const Specification s = reading::read(text + guarantee + "\n");
    const Budget budget;
    DeadEnds dead_ends(s, Section::EnvTrans, Section::SysTrans, variables(0, 40), variables(40, 53), budget);
    return dead_ends.search(Assignment(s.variables.size()));
  };
  EXPECT_EQ(search("a' & b' -> v'"), DeadEnds::Kind::None);
  EXPECT_EQ(search("w' = 3 | v'\nv' -> a' | !b'"), DeadEnds::Kind::None);
  EXPECT_EQ(search("w' = x' + 4000 | z' < 4"), DeadEnds::Kind::SystemStuck);
  EXPECT_EQ(search("v' <-> a'\nv' <-> b'"), DeadEnds::Kind::SystemStuck);
}

} // namespace

int main() {
  return expect::run([] {
    test_random_games();
    test_many_moves();
  });
}
