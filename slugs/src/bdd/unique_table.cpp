// Size of the operation cache; creation, marking and sweeping of nodes.

#include "bdd/unique_table.hpp"

#include "core/hash.hpp"

#include <algorithm>

namespace slugs {

// Size of the operation cache.

OperationCache::OperationCache(MemoryAccount &account) : account_(account), entries_(account) {
  entries_.resize(account.budget().tuning.cache_first);
  assert((entries_.size() & (entries_.size() - 1)) == 0);
}

void OperationCache::fit(std::size_t nodes) {
  // One entry per node while both fit the processor's caches, then one per four
  // nodes: a larger cache has few more hits, and each lookup is a memory access.
  const Tuning &t = account_.budget().tuning;
  const std::size_t wanted = std::min(std::max(std::min(nodes, t.cache_near), nodes / 4), t.cache_largest);
  const std::size_t old = entries_.size();
  std::size_t size = old;
  while (size < wanted)
    size *= 2;
  if (size == old || !account_.has_room((size - old) * sizeof(Entry)))
    return;
  assert(size > old && (size & (size - 1)) == 0);
  entries_.resize(size);
  // An entry stays, or moves up by a multiple of the old size.
  for (std::size_t i = 0; i < old; ++i) {
    const Entry entry = entries_[i];
    Entry &moved = entries_[slot_of(entry.f_and_operation, entry.g, entry.h)];
    assert((&moved - &entries_[i]) % static_cast<std::ptrdiff_t>(old) == 0 || !entry.f_and_operation);
    if (!entry.f_and_operation || &moved == &entries_[i])
      continue;
    moved = entry;
    entries_[i] = {};
  }
}

// Creation, marking and sweeping of nodes.  bdd.cpp checks the invariants.

UniqueTable::UniqueTable(std::uint32_t bits, const std::vector<std::uint32_t> &order, MemoryAccount &account,
                         OperationCache &cache)
    : account_(account), cache_(cache), nodes_(account), buckets_(account), marks_(account),
      level_of_var_(2 * std::size_t{bits} + 1), var_at_level_(2 * std::size_t{bits} + 1) {
  assert(order.size() == bits && bits < max_nodes);
  assert(std::all_of(order.begin(), order.end(), [&](std::uint32_t bit) { return bit < bits; }));
  for (std::uint32_t position = 0; position < bits; ++position) {
    var_at_level_[2 * position] = current_var(order[position]);
    var_at_level_[2 * position + 1] = next_var(order[position]);
  }
  var_at_level_[2 * bits] = 2 * bits;
  for (std::uint32_t l = 0; l <= 2 * bits; ++l)
    level_of_var_[var_at_level_[l]] = l;
  for ([[maybe_unused]] const Var v : var_at_level_)
    assert(var_at_level_[level_of_var_[v]] == v); // a permutation
  const std::size_t first_size = account.budget().tuning.table_first;
  nodes_.resize(first_size);
  buckets_.resize(first_size);
  marks_.resize(first_size / 32);
  nodes_[0] = {0, 0, 0, 2 * bits};
  assert((first_size & (first_size - 1)) == 0);
  assert(alive(bdd_false) && alive(bdd_true) && level(bdd_true) == 2 * bits);
}

std::size_t UniqueTable::bucket(Var v, Edge low, Edge high) const {
  std::uint64_t h = (std::uint64_t{low} << 32 | high) * golden_multiplier;
  h ^= h >> 32;
  h = (h + v) * second_multiplier;
  return static_cast<std::size_t>(h >> 32) & (buckets_.size() - 1);
}

Edge UniqueTable::make(Var v, Edge low, Edge high) {
  assert(alive(low) && alive(high));
  assert(level_of_var_[v] < level(low) && level_of_var_[v] < level(high));
  if (low == high)
    return low;
  const Edge complement = low & 1;
  low ^= complement;
  high ^= complement;
  assert((low & 1) == 0 && low != high);
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
  assert(live_ <= buckets_.size());
  return n << 1 | complement;
}

std::uint32_t UniqueTable::allocate() {
  // Everything that can throw precedes all changes, so that limits leave the table
  // consistent.
  if ((live_ & 0xFFF) == 0) {
    account_.budget().check();
    if (live_ > most_nodes_)
      throw OperationAborted();
  }
  std::uint32_t n = free_list_;
  if (n) {
    assert(n < used_ && nodes_[n].var == free_var);
    free_list_ = nodes_[n].chain;
  } else {
    if (used_ == nodes_.size())
      grow_nodes();
    n = used_++;
  }
  if (++live_ > peak_)
    peak_ = live_;
  assert(n > 0 && n < used_ && live_ < used_ && used_ <= nodes_.size());
  return n;
}

void UniqueTable::grow_nodes() {
  // Small tables double; large ones grow by half to save memory.
  const std::size_t old = nodes_.size();
  std::size_t size = old < account_.budget().tuning.table_doubled ? 2 * old : old + old / 2;
  if (old >= max_nodes)
    MemoryAccount::refuse();
  size = std::min<std::size_t>(size, max_nodes);
  marks_.resize((size + 31) / 32);
  nodes_.resize(size);
  assert(nodes_.size() > old && 32 * marks_.size() >= nodes_.size());
  cache_.fit(size);
}

void UniqueTable::grow_buckets() {
  const std::size_t size = 2 * buckets_.size();
  assert((size & (size - 1)) == 0);
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

void UniqueTable::mark(Edge f) {
  assert(alive(f));
  std::uint32_t n = f >> 1;
  // Only the low branch recurses; the depth is at most the number of levels.
  while (n && !marked(n)) {
    set_mark(n);
    mark(nodes_[n].low);
    n = nodes_[n].high >> 1;
  }
}

std::size_t UniqueTable::count_marks() const {
  std::size_t count = 0;
  for (std::size_t w = 0; w < marks_.size(); ++w)
    count += static_cast<std::size_t>(__builtin_popcount(marks_[w]));
  return count;
}

void UniqueTable::sweep() {
  buckets_.clear_to_zero();
  free_list_ = 0;
  live_ = 0;
  for (std::uint32_t n = used_ - 1; n > 0; --n) {
    Node &node = nodes_[n];
    if (!marked(n)) {
      free_node(n);
      continue;
    }
    assert(node.var != free_var); // else an edge to a freed node was in use
    const std::size_t b = bucket(node.var, node.low, node.high);
    node.chain = buckets_[b];
    buckets_[b] = n;
    ++live_;
  }
  assert(live_ == count_marks());
}

} // namespace slugs
