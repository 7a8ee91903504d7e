// Handles, garbage collection, inspection, and functions stored outside of the store.

#include "bdd/bdd.hpp"

#include "bdd/reordering.hpp"
#include "bdd/unique_table.hpp"
#include "core/hash.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

namespace slugs {

// Handles, garbage collection, and execution of operations on handles.

void Bdd::link() {
  if (!store_)
    return;
  before_ = nullptr;
  after_ = store_->handles_;
  assert(!after_ || !after_->before_);
  if (after_)
    after_->before_ = this;
  // GCC takes the list of handles for a leak of a local's address: `unlink` takes each one out.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpragmas"
#pragma GCC diagnostic ignored "-Wunknown-warning-option"
#pragma GCC diagnostic ignored "-Wdangling-pointer"
  store_->handles_ = this;
#pragma GCC diagnostic pop
}

void Bdd::unlink() {
  if (!store_)
    return;
  assert((before_ ? before_->after_ : store_->handles_) == this);
  assert(!after_ || after_->before_ == this);
  (before_ ? before_->after_ : store_->handles_) = after_;
  if (after_)
    after_->before_ = before_;
}

BddStore::BddStore(std::uint32_t bits, const std::vector<std::uint32_t> &order, const Budget &budget)
    : account_(budget), operations_(bits, order, account_) {
  plan_collection();
}

// Run an operation on handles.  If it exceeds its node or work limit, sift and
// repeat it.  If memory is exhausted, collect garbage and repeat it once.
template <typename Work> Bdd BddStore::run(const Work &work) {
  before_operation();
  for (unsigned given_up = 0;;) {
    try {
      set_bounds();
      const Edge result = work();
      release_bounds();
      assert(operations_.is_alive(result));
      return Bdd(*this, result);
    } catch (const OperationAborted &) {
      assert(reordering_ && collection_allowed_); // else there are no limits
      release_bounds();
      reordering_->after_abort(++given_up);
    } catch (const LimitReached &limit) {
      release_bounds();
      if (limit.kind != LimitKind::Memory || !collection_allowed_)
        throw;
      collect();
      return Bdd(*this, work());
    }
  }
}

void BddStore::before_operation() {
  if (!collection_allowed_)
    return;
  if (reordering_)
    reordering_->before_operation();
  if (live_nodes() >= collect_at_)
    collect();
}

void BddStore::set_bounds() {
  if (!reordering_ || !collection_allowed_)
    return;
  operations_.table().limit_nodes(reordering_->node_limit());
  operations_.most_operation_work = reordering_->work_limit();
}

void BddStore::release_bounds() {
  operations_.table().limit_nodes(UniqueTable::unbounded);
  operations_.most_operation_work = Operations::unlimited_work;
}

// Dead nodes cost memory and cache misses; collections cost time and cached results.
// So the first collections keep the table small, and later ones are rarer.
void BddStore::plan_collection() {
  const Tuning &t = tuning();
  const std::size_t least = collections_ < t.collections_early ? t.collect_early : t.collect_late;
  collect_at_ = std::max(least, t.collect_growth * live_nodes());
  assert(collect_at_ >= live_nodes());
}

void BddStore::collect() {
  UniqueTable &table = operations_.table();
  table.clear_marks();
  for (const Bdd *h = handles_; h; h = h->after_)
    table.mark(h->edge_); // asserts that the node is alive
  [[maybe_unused]] const std::size_t before = live_nodes();
  operations_.sweep();
  assert(live_nodes() <= before);
  ++collections_;
  collected_ = live_nodes();
  plan_collection();
}

void BddStore::order_changed() {
#ifndef NDEBUG
  assert_consistent();
#endif
  operations_.order_changed();
  collected_ = live_nodes();
  plan_collection();
}

Bdd BddStore::variable(Var v) {
  assert(v < 2 * bits());
  return run([&] { return operations_.node(v, bdd_false, bdd_true); });
}

Bdd BddStore::conjunction(const Bdd &f, const Bdd &g) {
  assert(owns(f) && owns(g));
  return run([&] { return operations_.conjunction(f.edge(), g.edge()); });
}

Bdd BddStore::exclusive_or(const Bdd &f, const Bdd &g) {
  assert(owns(f) && owns(g));
  return run([&] { return operations_.exclusive_or(f.edge(), g.edge()); });
}

Bdd BddStore::ite(const Bdd &f, const Bdd &g, const Bdd &h) {
  assert(owns(f) && owns(g) && owns(h));
  return run([&] { return operations_.ite(f.edge(), g.edge(), h.edge()); });
}

Bdd BddStore::exists(const Bdd &f, VarSet set) {
  assert(owns(f));
  if (operations_.is_empty(set))
    return f;
  return run([&] { return operations_.exists(f.edge(), set); });
}

Bdd BddStore::forall(const Bdd &f, VarSet set) { return !exists(!f, set); }

Bdd BddStore::and_exists(const Bdd &f, const Bdd &g, VarSet set) {
  assert(owns(f) && owns(g));
  if (operations_.is_empty(set))
    return conjunction(f, g);
  return run([&] { return operations_.and_exists(f.edge(), g.edge(), set); });
}

Bdd BddStore::minus_and_exists(const Bdd &f, const Bdd &g, const Bdd &h, VarSet set) {
  assert(owns(f) && owns(g) && owns(h));
  if (operations_.is_empty(set))
    return conjunction(f, !conjunction(g, h));
  operations_.select_minus_set(set);
  return run([&] { return operations_.minus_and_exists(f.edge(), g.edge(), h.edge(), set); });
}

Bdd BddStore::to_next(const Bdd &f) {
  assert(owns(f));
  return run([&] { return operations_.shift(f.edge(), Operations::ToNext); });
}

Bdd BddStore::to_current(const Bdd &f) {
  assert(owns(f));
  return run([&] { return operations_.shift(f.edge(), Operations::ToCurrent); });
}

Bdd BddStore::simplify(const Bdd &f, const Bdd &care) {
  assert(owns(f) && owns(care) && !care.is_false());
  return run([&] { return operations_.simplify(f.edge(), care.edge()); });
}

// Evaluation, satisfying valuations, support and size of functions.

bool BddStore::evaluate(Edge f, const std::vector<bool> &value_of_var) const {
  assert(value_of_var.size() == 2 * std::size_t{bits()});
  while (f > 1)
    f = value_of_var[operations_.var_of(f)] ? operations_.high_of(f) : operations_.low_of(f);
  return f == bdd_true;
}

std::vector<bool> BddStore::some_valuation(const Bdd &f) const {
  assert(owns(f) && !f.is_false());
  std::vector<bool> result(2 * std::size_t{bits()}, false);
  for (Edge e = f.edge(); e > 1;) {
    const bool value = operations_.low_of(e) == bdd_false;
    result[operations_.var_of(e)] = value;
    e = value ? operations_.high_of(e) : operations_.low_of(e);
    assert(e != bdd_false);
  }
  assert(evaluate(f.edge(), result));
  return result;
}

double BddStore::count(const Bdd &f, const std::vector<Var> &over) const {
  // Compute the fraction of satisfying valuations and scale it, which needs no levels.
  // An edge and its complement are visited separately, since 1 - x loses precision.
  std::unordered_map<Edge, double> fraction{{bdd_false, 0.0}, {bdd_true, 1.0}};
  const auto visit = [&](const auto &self, Edge e) -> double {
    const auto known = fraction.find(e);
    if (known != fraction.end())
      return known->second;
    const double low = self(self, operations_.low_of(e));
    const double high = self(self, operations_.high_of(e));
    assert(low >= 0 && low <= 1 && high >= 0 && high <= 1);
    return fraction[e] = (low + high) / 2;
  };
  return std::ldexp(visit(visit, f.edge()), static_cast<int>(over.size()));
}

std::vector<Var> BddStore::support(const Bdd &f) {
  assert(owns(f));
  UniqueTable &table = operations_.table();
  table.clear_marks();
  std::vector<std::uint8_t> seen(table.levels(), 0);
  const auto visit = [&](const auto &self, Edge e) -> void {
    const std::uint32_t n = e >> 1;
    if (!n || table.marked(n))
      return;
    table.set_mark(n);
    assert(table.var_of(e) < 2 * bits());
    seen[table.var_of(e)] = 1;
    self(self, table.low_of(e));
    self(self, table.high_of(e));
  };
  visit(visit, f.edge());
  std::vector<Var> result;
  for (Var v = 0; v < seen.size(); ++v)
    if (seen[v])
      result.push_back(v);
  return result;
}

std::size_t BddStore::size(const Bdd &f) {
  assert(owns(f));
  UniqueTable &table = operations_.table();
  table.clear_marks();
  table.mark(f.edge());
  return table.count_marks();
}

// Copying a diagram out of the store and rebuilding it.

FrozenBdd::FrozenBdd(BddStore &store, const Bdd &f) : nodes_(store.account()) {
  const Operations &edges = store.edges();
  std::vector<Node> list;
  EdgeTable<std::uint32_t> places(store.account()); // positions in `list`, from 1, by node
  const auto visit = [&](const auto &self, Edge e) -> Edge {
    if (edges.is_terminal(e))
      return e;
    const Edge regular = e & ~1u;
    if (const std::uint32_t *known = places.find(regular >> 1))
      return *known << 1 | (e & 1);
    const Edge low = self(self, edges.low_of(regular));
    const Edge high = self(self, edges.high_of(regular));
    assert((low & 1) == 0 && low >> 1 <= list.size() && high >> 1 <= list.size()); // children first
    list.push_back({edges.var_of(regular), low, high});
    const auto place = static_cast<std::uint32_t>(list.size());
    places.add(regular >> 1, place);
    return place << 1 | (e & 1);
  };
  assert(store.owns(f));
  root_ = visit(visit, f.edge());
  assert(root_ >> 1 == list.size()); // the root is last
  nodes_.resize(list.size());
  for (std::size_t i = 0; i < list.size(); ++i)
    nodes_[i] = list[i];
}

Bdd FrozenBdd::thaw(BddStore &store) const {
  store.collect_or_reorder_if_due();
  std::vector<Edge> built(nodes_.size() + 1, bdd_false);
  const auto edge = [&](Edge e) { return built[e >> 1] ^ (e & 1); };
  assert(root_ >> 1 == nodes_.size());
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    built[i + 1] = store.edges().branch(nodes_[i].var, edge(nodes_[i].low), edge(nodes_[i].high));
  return Bdd(store, edge(root_));
}

// Invariants of the unique table between operations.  Debug builds check them after
// each reordering.

namespace {

[[noreturn]] void fail(const std::string &what) { throw std::logic_error("BDD store: " + what); }

} // namespace

void UniqueTable::assert_consistent() const {
  std::size_t live = 0;
  for (std::uint32_t n = 1; n < used_; ++n) {
    const Node &node = nodes_[n];
    if (node.var == free_var)
      continue;
    ++live;
    if (node.low & 1)
      fail("low edge is complemented");
    if (node.low == node.high)
      fail("redundant node");
    for (const Edge child : {node.low, node.high}) {
      if (nodes_[child >> 1].var == free_var)
        fail("edge to a free node");
      if (level(child) <= level_of_var_[node.var])
        fail("edge does not go down");
    }
    std::size_t found = 0;
    for (std::uint32_t m = buckets_[bucket(node.var, node.low, node.high)]; m; m = nodes_[m].chain)
      if (nodes_[m].var == node.var && nodes_[m].low == node.low && nodes_[m].high == node.high)
        found += m == n ? 1 : 2;
    if (found != 1)
      fail("node is missing from the unique table, or not unique");
  }
  if (live != live_)
    fail("wrong count of nodes");
  std::size_t chained = 0;
  for (std::size_t b = 0; b < buckets_.size(); ++b)
    for (std::uint32_t n = buckets_[b]; n; n = nodes_[n].chain)
      ++chained;
  if (chained != live_)
    fail("stray node in the unique table");
  std::size_t freed = 0;
  for (std::uint32_t n = free_list_; n; n = nodes_[n].chain) {
    ++freed;
    if (nodes_[n].var != free_var)
      fail("used node in the free list");
  }
  if (freed + live_ + 1 != used_)
    fail("node lost");
  for (std::uint32_t l = 0; l < var_at_level_.size(); ++l)
    if (level_of_var_[var_at_level_[l]] != l)
      fail("order and its inverse disagree");
  for (std::uint32_t position = 0; position < bits(); ++position)
    if (var_at_level_[2 * position] + 1 != var_at_level_[2 * position + 1] || var_at_level_[2 * position] % 2)
      fail("a pair is torn");
}

void BddStore::assert_consistent() const {
  const UniqueTable &table = operations_.table();
  table.assert_consistent();
  for (const Bdd *h = handles_; h; h = h->after_)
    if (!table.alive(h->edge_))
      fail("handle to a free node");
}

} // namespace slugs
