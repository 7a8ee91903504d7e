// The checker's enumeration of allowed valuations, against trying all of them.

#include "certificate/moves/completions.hpp"
#include "expect.hpp"
#include "reading.hpp"

#include <random>
#include <set>

using namespace slugs;

namespace {

constexpr unsigned bits = 9;

// A random formula in prefix notation over variables v0 .. v8, now and next.
std::string formula(std::mt19937 &random, int depth) {
  if (depth == 0 || random() % 6 == 0)
    return (random() % 2 ? "! v" : "v") + std::to_string(random() % bits) + (random() % 2 ? "'" : "");
  static const char *const operators[] = {"& ", "| ", "| ", "^ ", "! ^ "};
  const std::string op = operators[random() % 5];
  const std::string left = formula(random, depth - 1);
  return op + left + " " + formula(random, depth - 1);
}

void compare(const Specification &s, const std::vector<OpenVariable> &open, std::uint64_t limit,
             std::mt19937 &random) {
  const Budget budget;
  Completions completions(s, {Section::SysTrans, Section::SysLiveness}, open, limit, budget);
  Assignment assignment(bits);
  std::uint64_t known_now[lanes], known_next[lanes];
  for (unsigned lane = 0; lane < lanes; ++lane) {
    known_now[lane] = random();
    known_next[lane] = random();
    for (unsigned v = 0; v < bits; ++v) {
      assignment.current[v].yes |= ((known_now[lane] >> v) & 1) << lane;
      assignment.next[v].yes |= ((known_next[lane] >> v) & 1) << lane;
    }
  }
  for (unsigned v = 0; v < bits; ++v) {
    assignment.current[v] = known(assignment.current[v].yes);
    assignment.next[v] = known(assignment.next[v].yes);
  }
  completions.load(assignment);
  std::vector<reading::Value> constraints;
  for (const Section section : {Section::SysTrans, Section::SysLiveness})
    for (const Constraint &constraint : s[section])
      constraints.emplace_back(s, constraint.formula);
  for (const unsigned lane : {0u, 17u, 63u}) {
    std::set<std::vector<bool>> wanted;
    for (std::uint64_t choice = 0; choice < (std::uint64_t{1} << open.size()); ++choice) {
      std::uint64_t now = known_now[lane], next = known_next[lane];
      std::vector<bool> values;
      for (std::size_t i = 0; i < open.size(); ++i) {
        std::uint64_t &side = open[i].next ? next : now;
        const std::uint64_t bit = std::uint64_t{1} << open[i].index;
        values.push_back((choice >> i) & 1);
        side = values.back() ? side | bit : side & ~bit;
      }
      bool good = true;
      for (reading::Value &value : constraints)
        good = good && value(now, next);
      if (good)
        wanted.insert(values);
    }
    const Completions::Answer &answer = completions.answer(lane);
    std::set<std::vector<bool>> found;
    completions.enumerate(answer, [&](const std::vector<bool> &values) {
      EXPECT(wanted.count(values) == 1);
      EXPECT(found.insert(values).second);
      return true;
    });
    if (wanted.size() <= limit) {
      EXPECT_EQ(answer.count, wanted.size());
      EXPECT(found == wanted);
    } else {
      EXPECT(answer.count > limit);
      EXPECT(found.size() > limit);
    }
  }
}

void test_random_constraints() {
  std::mt19937 random(23);
  for (int round = 0; round < 150; ++round) {
    std::string text = "[OUTPUT]\n";
    for (unsigned v = 0; v < bits; ++v)
      text += "v" + std::to_string(v) + "\n";
    text += "[SYS_TRANS]\n";
    for (unsigned lines = random() % 5; lines > 0; --lines)
      text += formula(random, 1 + static_cast<int>(random() % 4)) + "\n";
    text += "[SYS_LIVENESS]\n" + formula(random, 2) + "\n";
    const Specification s = reading::read(text);
    std::vector<OpenVariable> open;
    for (unsigned v = 0; v < bits; ++v)
      if (random() % 10 != 0)
        open.push_back({v, random() % 4 != 0});
    compare(s, open, random() % 2 ? 1000 : 3, random);
  }
}

} // namespace

int main() {
  return expect::run([] { test_random_constraints(); });
}
