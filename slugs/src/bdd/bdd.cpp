// Handles, garbage collection, and execution of operations on handles.

#include "bdd/bdd.hpp"

#include "bdd/reordering.hpp"

#include <algorithm>

namespace slugs {

void Bdd::link() {
  if (!store_)
    return;
  before_ = nullptr;
  after_ = store_->handles_;
  if (after_)
    after_->before_ = this;
  store_->handles_ = this;
}

void Bdd::unlink() {
  if (!store_)
    return;
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
      return Bdd(*this, result);
    } catch (const OperationAborted &) {
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
  const std::size_t least = collections_ < 8 ? 1 << 16 : 1 << 18;
  collect_at_ = std::max(least, 3 * live_nodes());
}

void BddStore::collect() {
  UniqueTable &table = operations_.table();
  table.clear_marks();
  for (const Bdd *h = handles_; h; h = h->after_)
    table.mark(h->edge_);
  operations_.sweep();
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
  return run([&] { return operations_.node(v, bdd_false, bdd_true); });
}

Bdd BddStore::conjunction(const Bdd &f, const Bdd &g) {
  return run([&] { return operations_.conjunction(f.edge(), g.edge()); });
}

Bdd BddStore::exclusive_or(const Bdd &f, const Bdd &g) {
  return run([&] { return operations_.exclusive_or(f.edge(), g.edge()); });
}

Bdd BddStore::ite(const Bdd &f, const Bdd &g, const Bdd &h) {
  return run([&] { return operations_.ite(f.edge(), g.edge(), h.edge()); });
}

Bdd BddStore::exists(const Bdd &f, VarSet set) {
  if (operations_.is_empty(set))
    return f;
  return run([&] { return operations_.exists(f.edge(), set); });
}

Bdd BddStore::forall(const Bdd &f, VarSet set) { return !exists(!f, set); }

Bdd BddStore::and_exists(const Bdd &f, const Bdd &g, VarSet set) {
  if (operations_.is_empty(set))
    return conjunction(f, g);
  return run([&] { return operations_.and_exists(f.edge(), g.edge(), set); });
}

Bdd BddStore::minus_and_exists(const Bdd &f, const Bdd &g, const Bdd &h, VarSet set) {
  if (operations_.is_empty(set))
    return conjunction(f, !conjunction(g, h));
  operations_.select_minus_set(set);
  return run([&] { return operations_.minus_and_exists(f.edge(), g.edge(), h.edge(), set); });
}

Bdd BddStore::to_next(const Bdd &f) {
  return run([&] { return operations_.shift(f.edge(), Operations::ToNext); });
}

Bdd BddStore::to_current(const Bdd &f) {
  return run([&] { return operations_.shift(f.edge(), Operations::ToCurrent); });
}

Bdd BddStore::simplify(const Bdd &f, const Bdd &care) {
  assert(!care.is_false());
  return run([&] { return operations_.simplify(f.edge(), care.edge()); });
}

} // namespace slugs
