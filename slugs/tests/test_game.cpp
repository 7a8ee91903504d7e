// Detection of independent parts of the environment, and products with one
// relation at a time.

#include "bdd/bdd.hpp"
#include "expect.hpp"
#include "game/analysis.hpp"
#include "game/game.hpp"
#include "reading.hpp"

#include <random>
#include <string>
#include <vector>

using namespace slugs;

namespace test_game {
namespace {

const std::string two_walkers = "[INPUT]\nhere\na:0...3\nb:0...3\n[OUTPUT]\ngo\n"
                                "[ENV_TRANS]\na = 0 -> a' < 2\nb = 1 -> (b' = 2 | here)\nhere' <-> go\n"
                                "here -> a' != 3\n"
                                "[SYS_TRANS]\ngo' -> a' != b'\na = 3 -> b' != 0\n";

std::string found(const std::string &text) {
  Specification specification = reading::read(text);
  std::string result;
  const Environment environment =
      independent_parts(specification, Conjuncts(specification, Budget{}), Budget{});
  for (const IndependentPart &part : environment.parts) {
    for (const std::uint32_t v : part.own)
      result += specification.variables[v].name + " ";
    result += std::to_string(part.constraints.size()) + "; ";
  }
  return result + std::to_string(environment.shared.size());
}

void test_parts_are_found() {
  EXPECT_EQ(found(two_walkers), "a@0.0.3 a@1 2; b@0.0.3 b@1 1; 1");
  // Other readers of their present values: a guarantee and liveness.
  EXPECT_EQ(found(two_walkers + "go' | a = 2\n"), "4");
  EXPECT_EQ(found(two_walkers + "[SYS_LIVENESS]\nb = 2 & go\n"), "4");
  EXPECT_EQ(found(two_walkers + "[ENV_LIVENESS]\na = 2\n"), "4");
  // Each other: one group of next inputs, or a group that reads the other's present.
  EXPECT_EQ(found(two_walkers + "[ENV_TRANS]\na' != b'\n"), "5");
  EXPECT_EQ(found(two_walkers + "[ENV_TRANS]\na' != b\n"), "5");
  EXPECT_EQ(found(two_walkers + "[ENV_TRANS]\na != 2\n"), "5");
}

void test_the_start_order_has_one_part_above_the_rest() {
  const Specification specification = reading::read(two_walkers);
  std::string order;
  const Conjuncts conjuncts(specification, Budget{});
  const Environment environment = independent_parts(specification, conjuncts, Budget{});
  for (const std::uint32_t v :
       start_order(specification.variables.size(), conjuncts, environment.parts, Budget{}))
    order += specification.variables[v].name[0];
  EXPECT(order == "aahgbb" || order == "aaghbb" || order == "bbhgaa" || order == "bbghaa");
}

void test_the_start_order_begins_with_hubs() {
  std::string buttons, keep;
  for (int i = 0; i < 32; ++i) {
    const std::string n = std::to_string(i);
    buttons += "b" + n + "\n";
    keep += "b" + n + " & floor != " + n + " -> b" + n + "'\n";
  }
  const Specification specification =
      reading::read("[INPUT]\n" + buttons + "[OUTPUT]\nfloor:0...31\n[ENV_TRANS]\n" + keep);
  const Conjuncts conjuncts(specification, Budget{});
  const std::vector<std::uint32_t> order =
      start_order(specification.variables.size(), conjuncts, {}, Budget{});
  EXPECT_EQ(order.size(), 37u);
  for (std::size_t k = 0; k < order.size(); ++k)
    EXPECT_EQ(specification.variables[order[k]].name[0] == 'f', k < 5);
}

void test_products_quantify_early_what_they_would_at_the_end() {
  std::mt19937 random(1);
  for (int round = 0; round < 50; ++round) {
    BddStore store(5, {0, 1, 2, 3, 4}, Budget{});
    const auto some = [&] {
      Bdd result = store.constant(random() % 2 == 0);
      for (int i = 0; i < 6; ++i) {
        const Bdd v = store.variable(random() % 10);
        result = random() % 2 ? result & v : result ^ v;
      }
      return result;
    };
    std::vector<Bdd> relations;
    for (unsigned i = random() % 4; i > 0; --i)
      relations.push_back(some() | some());
    std::vector<Var> quantified;
    for (Var v = 0; v < 10; ++v)
      if (random() % 2)
        quantified.push_back(v);
    const Bdd f = some() | some();
    Bdd all = f;
    for (const Bdd &relation : relations)
      all &= relation;
    EXPECT(Product(store, relations, quantified)(f) == store.exists(all, store.make_set(quantified)));
  }
}

const expect::Suite suite("test_game", [] {
  test_parts_are_found();
  test_the_start_order_has_one_part_above_the_rest();
  test_the_start_order_begins_with_hubs();
  test_products_quantify_early_what_they_would_at_the_end();
});

} // namespace
} // namespace test_game
