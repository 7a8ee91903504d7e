// Nodes, their uniqueness, and their collection.  What is computed on them is in
// bdd/operations.cpp; how they are reordered, in bdd/sifting.cpp.

#include "bdd/bdd.hpp"

#include "bdd/reordering.hpp"
#include "core/hash.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

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
    : account_(budget), nodes_(account_), buckets_(account_), cache_(account_), marks_(account_),
      level_of_var_(2 * std::size_t{bits} + 1), var_at_level_(2 * std::size_t{bits} + 1) {
  for (std::uint32_t position = 0; position < bits; ++position) {
    var_at_level_[2 * position] = current_var(order[position]);
    var_at_level_[2 * position + 1] = next_var(order[position]);
  }
  var_at_level_[2 * bits] = 2 * bits;
  for (std::uint32_t l = 0; l <= 2 * bits; ++l)
    level_of_var_[var_at_level_[l]] = l;
  constexpr std::size_t first_size = 1 << 12;
  nodes_.resize(first_size);
  buckets_.resize(first_size);
  marks_.resize(first_size / 32);
  cache_.resize(first_size);
  nodes_[0] = {0, 0, 0, 2 * bits};
  plan_collection();
}

std::size_t BddStore::bucket(Var v, Edge low, Edge high) const {
  std::uint64_t h = (std::uint64_t{low} << 32 | high) * golden_multiplier;
  h ^= h >> 32;
  h = (h + v) * second_multiplier;
  return static_cast<std::size_t>(h >> 32) & (buckets_.size() - 1);
}

// The only way in which nodes come to be.  `v` is above the edges' variables.
Edge BddStore::make(Var v, Edge low, Edge high) {
  assert(alive(low) && alive(high));
  assert(level_of_var_[v] < level(low) && level_of_var_[v] < level(high));
  if (low == high)
    return low;
  const Edge complement = low & 1;
  low ^= complement;
  high ^= complement;
  const std::size_t b = bucket(v, low, high);
  for (std::uint32_t n = buckets_[b]; n; n = nodes_[n].chain) {
    const Node &node = nodes_[n];
    if (node.low == low && node.high == high && node.var == v)
      return n << 1 | complement;
  }
  const bool crowded = live_ >= buckets_.size();
  if (crowded)
    grow_buckets();
  const std::size_t place = crowded ? bucket(v, low, high) : b;
  const std::uint32_t n = allocate();
  nodes_[n] = {low, high, buckets_[place], v};
  buckets_[place] = n;
  return n << 1 | complement;
}

std::uint32_t BddStore::allocate() {
  // Whatever throws comes first, so that a limit leaves the store consistent.
  if ((live_ & 0xFFF) == 0) {
    check_budget();
    if (live_ > most_nodes_)
      throw Outgrown();
  }
  std::uint32_t n = free_list_;
  if (n) {
    free_list_ = nodes_[n].chain;
  } else {
    if (used_ == nodes_.size())
      grow_nodes();
    n = used_++;
  }
  if (++live_ > peak_)
    peak_ = live_;
  return n;
}

void BddStore::check_budget() { account_.budget().check(); }

void BddStore::grow_nodes() {
  // By half where memory counts, by two while it does not.
  const std::size_t old = nodes_.size();
  std::size_t size = old < (1u << 20) ? 2 * old : old + old / 2;
  if (old >= max_nodes)
    MemoryAccount::refuse();
  size = std::min<std::size_t>(size, max_nodes);
  marks_.resize((size + 31) / 32);
  nodes_.resize(size);
  resize_cache();
}

void BddStore::grow_buckets() {
  const std::size_t size = 2 * buckets_.size();
  buckets_.resize(size);
  buckets_.clear_to_zero();
  for (std::uint32_t n = 1; n < used_; ++n) {
    Node &node = nodes_[n];
    if (node.var == free_var)
      continue;
    const std::size_t b = bucket(node.var, node.low, node.high);
    node.chain = buckets_[b];
    buckets_[b] = n;
  }
}

void BddStore::before_operation() {
  if (!collection_allowed_)
    return;
  if (reordering_)
    reordering_->before_operation();
  if (live_ >= collect_at_)
    collect();
}

void BddStore::set_bounds() {
  if (!reordering_ || !collection_allowed_)
    return;
  most_nodes_ = reordering_->most_nodes();
  most_operation_work_ = reordering_->most_work();
}

void BddStore::reorder_for_operation(unsigned given_up) { reordering_->after_giving_up(given_up); }

void BddStore::mark(Edge f) {
  std::uint32_t n = f >> 1;
  // Only the low branch recurses; recursion is as deep as there are levels.
  while (n && !marked(n)) {
    set_mark(n);
    mark(nodes_[n].low);
    n = nodes_[n].high >> 1;
  }
}

// Dead nodes cost memory and cache misses, collections cost time and results: a
// short run stays small, a long one collects less often.
void BddStore::plan_collection() {
  const std::size_t least = collections_ < 8 ? 1 << 16 : 1 << 18;
  collect_at_ = std::max(least, 3 * live_);
}

void BddStore::clear_marks() { marks_.clear_to_zero(); }

void BddStore::collect() {
  clear_marks();
  for (const Bdd *h = handles_; h; h = h->after_)
    mark(h->edge_);
  // Results in the cache that speak of surviving nodes only stay valid.
  const auto dead = [this](Edge f) { return (f >> 1) && !marked(f >> 1); };
  for (std::size_t i = 0; i < cache_.size(); ++i) {
    CacheEntry &entry = cache_[i];
    if (!entry.f_and_operation)
      continue;
    const std::uint32_t op = entry.f_and_operation >> operation_shift;
    const Edge f = entry.f_and_operation & ((1u << operation_shift) - 1);
    if (dead(f) || dead(entry.result) || (op != Exists && dead(entry.g)) ||
        ((op == Choice || op == MinusExistsBoth) && dead(entry.h)))
      entry = {};
  }
  buckets_.clear_to_zero();
  free_list_ = 0;
  live_ = 0;
  for (std::uint32_t n = used_ - 1; n > 0; --n) {
    Node &node = nodes_[n];
    if (marked(n)) {
      const std::size_t b = bucket(node.var, node.low, node.high);
      node.chain = buckets_[b];
      buckets_[b] = n;
      ++live_;
    } else {
      node = {0, 0, free_list_, free_var};
      free_list_ = n;
    }
  }
  ++collections_;
  collected_ = live_;
  plan_collection();
}

Bdd BddStore::variable(Var v) {
  return run([&] { return make(v, bdd_false, bdd_true); });
}

Edge BddStore::node(Var v, Edge low, Edge high) { return make(v, low, high); }

VarSet BddStore::make_set(const std::vector<Var> &members) {
  QuantifiedSet set;
  set.contains.assign(level_of_var_.size(), 0);
  for (const Var v : members)
    set.contains[v] = 1;
  sets_.push_back(std::move(set));
  order_changed();
  return static_cast<VarSet>(sets_.size() - 1);
}

void BddStore::order_changed() {
  for (std::uint32_t l = 0; l < var_at_level_.size(); ++l)
    level_of_var_[var_at_level_[l]] = l;
  for (QuantifiedSet &set : sets_) {
    set.last_level = 0;
    set.empty = true;
    for (Var v = 0; v + 1 < set.contains.size(); ++v)
      if (set.contains[v]) {
        set.empty = false;
        set.last_level = std::max(set.last_level, level_of_var_[v]);
      }
  }
}

void BddStore::assert_consistent() const {
  const auto fail = [](const std::string &what) { throw std::logic_error("BDD store: " + what); };
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
  for (const Bdd *h = handles_; h; h = h->after_)
    if (nodes_[h->edge_ >> 1].var == free_var)
      fail("handle to a free node");
}

} // namespace slugs
