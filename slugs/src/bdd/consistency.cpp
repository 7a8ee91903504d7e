// Invariants of the unique table between operations.  Debug builds check them after
// each reordering.

#include "bdd/bdd.hpp"
#include "bdd/unique_table.hpp"

#include <stdexcept>
#include <string>

namespace slugs {

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
