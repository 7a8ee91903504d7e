// Lists of valuations out of diagrams, against going through all valuations: for
// states of one, two and three words, any order of variables, and inputs and
// outputs mixed in the declarations.

#include "strategy/successors.hpp"

#include "expect.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <string>
#include <vector>

using namespace slugs;

namespace test_successors {
namespace {

using Valuation = std::string; // 0 or 1 by bit, as declared; compares lexicographically

constexpr unsigned active = 8; // bits that a function is about; the others are constant or free

// A random function of the next variables, and the valuations that it allows.
struct RandomFunction {
  Bdd f;
  std::vector<Valuation> allowed;
};

RandomFunction make(Game &game, std::mt19937 &random) {
  BddStore &store = game.store;
  std::vector<std::uint32_t> bits(store.bits());
  std::iota(bits.begin(), bits.end(), 0u);
  std::shuffle(bits.begin(), bits.end(), random);
  const auto literal = [&](std::uint32_t bit, bool value) {
    const Bdd v = store.variable(next_var(bit));
    return value ? v : !v;
  };
  std::vector<bool> table(1u << active);
  const unsigned density = 1 + random() % 7;
  // Rows beside each other are joined by a bit each until one function is left.
  std::vector<Bdd> rows;
  for (unsigned row = 0; row < table.size(); ++row) {
    table[row] = random() % 8 < density;
    rows.push_back(store.constant(table[row]));
  }
  for (unsigned k = 0; k < active; ++k)
    for (std::size_t row = 0; row < table.size() >> (k + 1); ++row)
      rows[row] = (literal(bits[k], false) & rows[2 * row]) | (literal(bits[k], true) & rows[2 * row + 1]);
  // Up to two more may have either value, all others only one.
  const std::size_t free = std::min<std::size_t>(random() % 3, bits.size() - active);
  Valuation constant(store.bits(), 0);
  Bdd only = store.constant(true);
  for (std::size_t k = active + free; k < bits.size(); ++k) {
    constant[bits[k]] = random() % 2;
    only &= literal(bits[k], constant[bits[k]]);
  }
  RandomFunction result{rows[0] & only, {}};
  for (unsigned row = 0; row < table.size(); ++row)
    for (unsigned choice = 0; table[row] && choice < 1u << free; ++choice) {
      Valuation v = constant;
      for (unsigned k = 0; k < active; ++k)
        v[bits[k]] = (row >> k) & 1;
      for (std::size_t k = 0; k < free; ++k)
        v[bits[active + k]] = (choice >> k) & 1;
      result.allowed.push_back(v);
    }
  std::sort(result.allowed.begin(), result.allowed.end());
  return result;
}

std::vector<Valuation> least_for_each_input(const Specification &specification,
                                            const std::vector<Valuation> &allowed) {
  std::map<Valuation, Valuation> least; // by inputs; of valuations in ascending order the first counts
  for (const Valuation &v : allowed) {
    Valuation inputs;
    for (std::size_t bit = 0; bit < v.size(); ++bit)
      if (specification.variables[bit].owner == Owner::Input)
        inputs.push_back(v[bit]);
    least.try_emplace(inputs, v);
  }
  std::vector<Valuation> result;
  for (const auto &[inputs, v] : least)
    result.push_back(v);
  std::sort(result.begin(), result.end());
  return result;
}

std::vector<Valuation> unpack(const PackedStates &states, std::size_t bits) {
  std::vector<Valuation> result;
  for (std::size_t i = 0; i < states.size(); ++i) {
    result.emplace_back(bits, 0);
    for (std::size_t bit = 0; bit < bits; ++bit)
      result.back()[bit] = get_bit(states[i], bit);
  }
  return result;
}

void lists_are_those_of_all_valuations() {
  std::mt19937 random(11);
  for (const std::uint32_t bits : {8u, 12u, 64u, 65u, 128u, 150u})
    for (int game_number = 0; game_number < 6; ++game_number) {
      Specification specification;
      for (std::uint32_t bit = 0; bit < bits; ++bit)
        specification.variables.push_back(
            {"v" + std::to_string(bit), random() % 2 ? Owner::Input : Owner::Output, 1});
      std::vector<std::uint32_t> order(bits);
      std::iota(order.begin(), order.end(), 0u);
      std::shuffle(order.begin(), order.end(), random);
      Game game(specification, order, {});
      const CollectionPause no_collection(game.store);
      Successors least(game, Successors::Answers::Least), all(game, Successors::Answers::All);
      for (int k = 0; k < 12; ++k) {
        const RandomFunction g = make(game, random);
        EXPECT(unpack(all.of(g.f.edge()), bits) == g.allowed);
        EXPECT(unpack(least.of(g.f.edge()), bits) == least_for_each_input(specification, g.allowed));
        if (k % 5 == 4) {
          game.store.collect();
          least.forget();
          all.forget();
        }
      }
      EXPECT_EQ(least.of(bdd_false).size(), std::size_t{0});
    }
}

// Far more answers than inputs: only as many as there are inputs are listed.
void many_answers_cost_no_more_than_one() {
  Specification specification;
  for (std::uint32_t bit = 0; bit < 60; ++bit)
    specification.variables.push_back(
        {"v" + std::to_string(bit), bit % 20 ? Owner::Output : Owner::Input, 1});
  std::vector<std::uint32_t> order(60);
  std::iota(order.begin(), order.end(), 0u);
  Game game(specification, order, {});
  Successors successors(game, Successors::Answers::Least);
  // Any two neighbours are not both 0: outputs alternate as the inputs force them to.
  Bdd f = game.store.constant(true);
  for (std::uint32_t bit = 0; bit + 1 < 60; ++bit)
    f &= game.store.variable(next_var(bit)) | game.store.variable(next_var(bit + 1));
  const PackedStates &found = successors.of(f.edge());
  EXPECT_EQ(found.size(), std::size_t{8});
  for (std::size_t i = 0; i < found.size(); ++i)
    for (std::size_t bit = 0; bit < 60; ++bit) {
      const bool input = bit % 20 == 0, before = bit && get_bit(found[i], bit - 1);
      // As small as possible from the left; before an input that is 0 stands a 1.
      const bool forced = bit + 1 < 60 && (bit + 1) % 20 == 0 && !get_bit(found[i], bit + 1);
      if (!input)
        EXPECT_EQ(get_bit(found[i], bit), !before || forced);
    }
}

const expect::Suite suite("test_successors", [] {
  lists_are_those_of_all_valuations();
  many_answers_cost_no_more_than_one();
});

} // namespace
} // namespace test_successors
