// Pools of formulas, of ordinary size and larger.

#include "core/formula.hpp"
#include "expect.hpp"

#include <cstdint>
#include <vector>

using namespace slugs;

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

int main() {
  return expect::run([] {
    equal_formulas_are_one();
    a_very_large_pool_remembers_what_is_recent();
  });
}
