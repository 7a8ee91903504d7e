// The BDD core against truth tables: functions of eight variables (four pairs)
// are bit sets of 256 valuations, on which every operation is one line.

#include "bdd/bdd.hpp"
#include "bdd/reordering.hpp"
#include "expect.hpp"

#include <bitset>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

using namespace slugs;

namespace test_bdd {
namespace {

constexpr std::uint32_t bits = 4;
constexpr Var vars = 2 * bits;
using Table = std::bitset<256>;

Table variable_table(Var v) {
  Table t;
  for (std::size_t row = 0; row < t.size(); ++row)
    t[row] = (row >> v) & 1;
  return t;
}

Table exists_table(const Table &t, const std::vector<Var> &over) {
  Table result = t;
  for (const Var v : over) {
    const Table before = result;
    for (std::size_t row = 0; row < t.size(); ++row)
      result[row] = before[row] || before[row ^ (std::size_t{1} << v)];
  }
  return result;
}

Table cofactor_table(const Table &t, Var v, bool value) {
  Table result;
  for (std::size_t row = 0; row < t.size(); ++row)
    result[row] = t[value ? row | (std::size_t{1} << v) : row & ~(std::size_t{1} << v)];
  return result;
}

// Swaps current and next variable of every pair.
Table shifted_table(const Table &t) {
  Table result;
  for (std::size_t row = 0; row < t.size(); ++row)
    result[((row & 0x55) << 1) | ((row & 0xAA) >> 1)] = t[row];
  return result;
}

bool agrees(BddStore &store, Edge e, const Table &t) {
  std::vector<bool> values(vars);
  for (std::size_t row = 0; row < t.size(); ++row) {
    for (Var v = 0; v < vars; ++v)
      values[v] = (row >> v) & 1;
    if (store.evaluate(e, values) != t[row])
      return false;
  }
  return true;
}

struct Pair {
  Bdd bdd;
  Table table;
};

// A pool of functions that grows by random operations on its members.
class RandomLoad {
public:
  RandomLoad(unsigned seed, std::vector<std::uint32_t> order) : random_(seed), store_(bits, order, Budget{}) {
    for (Var v = 0; v < vars; ++v)
      pool_.push_back({store_.variable(v), variable_table(v)});
    pool_.push_back({store_.constant(false), Table()});
    for (unsigned mask = 0; mask < 16; ++mask) {
      std::vector<Var> members;
      for (std::uint32_t b = 0; b < bits; ++b)
        if ((mask >> b) & 1)
          members.push_back(next_var(b));
      if (mask == 6)
        members.push_back(current_var(0));
      sets_.push_back({store_.make_set(members), members});
    }
  }

  void step() {
    const Pair &f = pick(), &g = pick(), &h = pick();
    const auto &[set, members] = sets_[random_() % sets_.size()];
    Pair made;
    switch (random_() % 13) {
    case 0:
      made = {f.bdd & g.bdd, f.table & g.table};
      break;
    case 1:
      made = {f.bdd | g.bdd, f.table | g.table};
      break;
    case 2:
      made = {f.bdd ^ g.bdd, f.table ^ g.table};
      break;
    case 3:
      made = {!f.bdd, ~f.table};
      break;
    case 4:
      made = {store_.ite(f.bdd, g.bdd, h.bdd), (f.table & g.table) | (~f.table & h.table)};
      break;
    case 5:
      made = {store_.exists(f.bdd, set), exists_table(f.table, members)};
      break;
    case 6:
      made = {store_.forall(f.bdd, set), ~exists_table(~f.table, members)};
      break;
    case 7:
      made = {store_.and_exists(f.bdd, g.bdd, set), exists_table(f.table & g.table, members)};
      break;
    case 8: {
      const Table current = exists_table(f.table, {1, 3, 5, 7});
      made = {store_.to_next(store_.exists(f.bdd, all_next())), shifted_table(current)};
      break;
    }
    case 9: {
      const Table next = exists_table(f.table, {0, 2, 4, 6});
      made = {store_.to_current(store_.exists(f.bdd, all_current())), shifted_table(next)};
      break;
    }
    case 10: {
      const Bdd outer = store_.exists(f.bdd, set);
      const Table table = exists_table(f.table, members) & ~exists_table(g.table & h.table, members);
      made = {store_.minus_and_exists(outer, g.bdd, h.bdd, set), table};
      if (!made.bdd.is_false()) {
        const std::vector<bool> some = store_.some_valuation(made.bdd);
        EXPECT(store_.evaluate(made.bdd.edge(), some));
      }
      break;
    }
    case 11: {
      const Var v = random_() % vars;
      const bool value = random_() % 2;
      made = {Bdd(store_, store_.edges().cofactor(f.bdd.edge(), v, value)),
              cofactor_table(f.table, v, value)};
      break;
    }
    default:
      if (g.bdd.is_false())
        return;
      const Bdd simple = store_.simplify(f.bdd, g.bdd);
      EXPECT((simple & g.bdd) == (f.bdd & g.bdd));
      return;
    }
    EXPECT(agrees(store_, made.bdd.edge(), made.table));
    if (pool_.size() < 60)
      pool_.push_back(made);
    else
      pool_[vars + random_() % (pool_.size() - vars)] = made;
  }

  void check_all() {
    store_.assert_consistent();
    for (const Pair &f : pool_) {
      EXPECT(agrees(store_, f.bdd.edge(), f.table));
      EXPECT_EQ(store_.count(f.bdd, {0, 1, 2, 3, 4, 5, 6, 7}), static_cast<double>(f.table.count()));
      std::vector<Var> depends;
      for (Var v = 0; v < vars; ++v)
        if (cofactor_table(f.table, v, false) != cofactor_table(f.table, v, true))
          depends.push_back(v);
      EXPECT(store_.support(f.bdd) == depends);
      for (const Pair &g : pool_)
        EXPECT_EQ(f.bdd == g.bdd, f.table == g.table); // canonicity
    }
  }

  BddStore &store() { return store_; }

private:
  const Pair &pick() { return pool_[random_() % pool_.size()]; }
  VarSet all_next() { return sets_[15].first; }
  VarSet all_current() {
    if (!current_)
      current_ = store_.make_set({0, 2, 4, 6});
    return current_;
  }

  std::mt19937 random_;
  BddStore store_;
  std::vector<Pair> pool_;
  std::vector<std::pair<VarSet, std::vector<Var>>> sets_;
  VarSet current_ = 0;
};

void operations_agree_with_truth_tables() {
  for (unsigned seed = 0; seed < 12; ++seed) {
    RandomLoad load(seed, seed % 2 ? std::vector<std::uint32_t>{2, 0, 3, 1}
                                   : std::vector<std::uint32_t>{0, 1, 2, 3});
    for (int i = 0; i < 300; ++i)
      load.step();
    load.check_all();
  }
}

void functions_survive_collection_and_sifting() {
  std::mt19937 random(1);
  for (unsigned seed = 100; seed < 112; ++seed) {
    RandomLoad load(seed, {3, 1, 0, 2});
    for (int i = 0; i < 400; ++i) {
      load.step();
      if (random() % 10 == 0)
        load.store().collect();
      if (random() % 20 == 0) {
        SiftingLog log;
        sift(load.store(), log, random() % 2 ? 1.0 : 2.0);
        load.store().assert_consistent();
        if (random() % 2) {
          undo_sifting(load.store(), log);
          load.store().assert_consistent();
        }
      }
    }
    load.check_all();
    EXPECT(load.store().reorderings() > 0);
    EXPECT(load.store().collections() > 0);
  }
}

// x0 y0 + x1 y1 + ... is exponential if all x come before all y, and linear if
// partners are neighbours: sifting has to find that out.
void sifting_finds_a_linear_order() {
  constexpr std::uint32_t n = 12;
  std::vector<std::uint32_t> order(2 * n);
  for (std::uint32_t i = 0; i < 2 * n; ++i)
    order[i] = i;
  BddStore store(2 * n, order, Budget{});
  Bdd sum = store.constant(false);
  for (std::uint32_t i = 0; i < n; ++i)
    sum |= store.variable(current_var(i)) & store.variable(current_var(n + i));
  EXPECT(store.size(sum) > (1u << n));
  const double before = store.count(sum, std::vector<Var>(4 * n));
  SiftingLog log;
  const std::size_t size_before = store.size(sum);
  sift(store, log);
  undo_sifting(store, log);
  store.assert_consistent();
  EXPECT_EQ(store.size(sum), size_before);
  for (std::uint32_t i = 0; i < 2 * n; ++i)
    EXPECT_EQ(store.level_of(current_var(i)), 2 * i);
  sift(store, log);
  store.assert_consistent();
  EXPECT_EQ(store.size(sum), std::size_t{2 * n});
  EXPECT_EQ(store.count(sum, std::vector<Var>(4 * n)), before);
  EXPECT_EQ(store.live_nodes(), std::size_t{2 * n});
}

// Many nodes: tables grow within operations, lists of nodes within sifting.
void large_diagrams_stay_consistent() {
  constexpr std::uint32_t n = 24;
  std::vector<std::uint32_t> order(n);
  for (std::uint32_t i = 0; i < n; ++i)
    order[i] = i;
  BddStore store(n, order, Budget{});
  std::mt19937 random(7);
  std::vector<Bdd> pool;
  for (Var v = 0; v < 2 * n; ++v)
    pool.push_back(store.variable(v));
  for (int i = 0; i < 150; ++i) {
    Bdd clause = store.constant(false);
    for (int k = 0; k < 3; ++k)
      clause |= random() % 2 ? pool[random() % (2 * n)] : !pool[random() % (2 * n)];
    Bdd &part = i < 8 ? (pool.push_back(clause), pool.back()) : pool[2 * n + random() % 8];
    part = random() % 3 ? part ^ clause : part | clause;
    if (i % 20 == 19)
      store.assert_consistent();
  }
  const double before = store.count(pool.back(), std::vector<Var>(2 * n));
  EXPECT(store.peak_nodes() > 5000);
  SiftingLog log;
  sift(store, log);
  store.assert_consistent();
  EXPECT_EQ(store.count(pool.back(), std::vector<Var>(2 * n)), before);
  pool.clear();
  store.collect();
  store.assert_consistent();
  EXPECT_EQ(store.live_nodes(), std::size_t{0});
}

void memory_limit_is_an_exception_and_leaves_the_store_whole() {
  constexpr std::uint32_t n = 40;
  std::vector<std::uint32_t> order(n);
  for (std::uint32_t i = 0; i < n; ++i)
    order[i] = i;
  Budget budget;
  budget.memory_bytes = 4 << 20;
  BddStore store(n, order, budget);
  bool limited = false;
  Bdd sum = store.constant(false);
  try {
    for (std::uint32_t i = 0; i < n / 2; ++i)
      sum |= store.variable(current_var(i)) & store.variable(current_var(n / 2 + i));
  } catch (const LimitReached &limit) {
    limited = limit.kind == LimitKind::Memory;
  }
  EXPECT(limited);
  store.assert_consistent();
  EXPECT(store.account().peak() <= budget.memory_bytes);
}

void an_interrupt_stops_an_operation() {
  constexpr std::uint32_t n = 40;
  std::vector<std::uint32_t> order(n);
  for (std::uint32_t i = 0; i < n; ++i)
    order[i] = i;
  std::atomic<bool> interrupted{true};
  Budget budget;
  budget.interrupted = &interrupted;
  bool stopped = false;
  BddStore store(n, order, budget);
  Bdd sum = store.constant(false);
  try {
    for (std::uint32_t i = 0; i < n / 2; ++i)
      sum |= store.variable(current_var(i)) & store.variable(current_var(n / 2 + i));
  } catch (const LimitReached &limit) {
    stopped = limit.kind == LimitKind::Interrupt;
  }
  EXPECT(stopped);
  store.assert_consistent();
}

// Equality of two numbers: with all bits of one before those of the other it is
// exponential, with partners as neighbours linear.
Bdd equal_numbers(BddStore &store, std::uint32_t n, std::uint32_t first = 0, std::uint32_t every = 1) {
  Bdd all = store.constant(true);
  for (std::uint32_t i = first; i < n; i += every)
    all &= !(store.variable(current_var(i)) ^ store.variable(current_var(n + i)));
  return all;
}

void an_operation_that_outgrows_its_bound_starts_again_in_a_better_order() {
  constexpr std::uint32_t n = 22;
  std::vector<std::uint32_t> order(2 * n);
  for (std::uint32_t i = 0; i < 2 * n; ++i)
    order[i] = i;
  BddStore store(2 * n, order, Budget{});
  Reordering reordering(store);
  reordering.start_fixpoints(); // from now on nothing is sifted before an operation, only in one
  const std::uint64_t reorderings = store.reorderings();
  const Bdd before = store.variable(current_var(0)) ^ store.variable(next_var(2 * n - 1));
  const Bdd even = equal_numbers(store, n, 0, 2), odd = equal_numbers(store, n, 1, 2);
  EXPECT_EQ(store.reorderings(), reorderings);
  const Bdd all = even & odd;
  store.assert_consistent();
  EXPECT(store.reorderings() > reorderings);
  EXPECT(store.peak_nodes() < (1u << 20)); // more than 2^22 in the initial order
  EXPECT(store.size(all) < (1u << 16));
  EXPECT_EQ(store.count(all, std::vector<Var>(2 * n)), std::ldexp(1.0, n));
  // All earlier functions are unchanged.
  EXPECT((all & !even).is_false());
  EXPECT(before == (store.variable(current_var(0)) ^ store.variable(next_var(2 * n - 1))));
}

void an_operation_does_not_give_up_while_edges_without_handles_are_held() {
  constexpr std::uint32_t n = 17;
  std::vector<std::uint32_t> order(2 * n);
  for (std::uint32_t i = 0; i < 2 * n; ++i)
    order[i] = i;
  BddStore store(2 * n, order, Budget{});
  Reordering reordering(store);
  const CollectionPause pause(store);
  const Edge held = store.edges().branch(current_var(3), bdd_false, bdd_true);
  const Bdd all = equal_numbers(store, n);
  EXPECT_EQ(store.reorderings(), std::uint64_t{0});
  EXPECT_EQ(store.collections(), std::uint64_t{0});
  EXPECT(store.size(all) > (1u << n));
  EXPECT(held == store.variable(current_var(3)).edge());
  store.assert_consistent();
}

// A limit reached while an operation is aborted ends the operation, instead of
// restarting it.
void a_limit_ends_an_operation_that_starts_again() {
  constexpr std::uint32_t n = 22;
  std::vector<std::uint32_t> order(2 * n);
  for (std::uint32_t i = 0; i < 2 * n; ++i)
    order[i] = i;
  std::atomic<bool> interrupted{false};
  Budget budget;
  budget.interrupted = &interrupted;
  BddStore store(2 * n, order, budget);
  Reordering reordering(store);
  reordering.start_fixpoints();
  const Bdd even = equal_numbers(store, n, 0, 2), odd = equal_numbers(store, n, 1, 2);
  interrupted = true;
  bool stopped = false;
  try {
    const Bdd all = even & odd;
  } catch (const LimitReached &limit) {
    stopped = limit.kind == LimitKind::Interrupt;
  }
  EXPECT(stopped);
}

const expect::Suite suite("test_bdd", [] {
  operations_agree_with_truth_tables();
  functions_survive_collection_and_sifting();
  sifting_finds_a_linear_order();
  large_diagrams_stay_consistent();
  memory_limit_is_an_exception_and_leaves_the_store_whole();
  an_interrupt_stops_an_operation();
  an_operation_that_outgrows_its_bound_starts_again_in_a_better_order();
  an_operation_does_not_give_up_while_edges_without_handles_are_held();
  a_limit_ends_an_operation_that_starts_again();
});

} // namespace
} // namespace test_bdd
