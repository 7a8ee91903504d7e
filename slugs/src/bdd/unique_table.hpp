// The unique table: the nodes of all diagrams, each function once, and the variable
// order.
//
// The standard construction (Bryant 1986; Brace, Rudell and Bryant 1990) with
// complement edges and one table for all variables.  The low edge of a node is
// never complemented, which makes the form canonical.  A pair of variables always
// occupies two adjacent levels, current above next, so that priming a function
// renames its nodes and keeps its shape.
//
// BddStore marks the nodes in use before it sweeps the table.

#pragma once

#include "bdd/edge.hpp"
#include "bdd/operation_cache.hpp"
#include "core/counted_array.hpp"

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace slugs {

// Thrown by an operation that exceeds its node or work limit, see BddStore::run().
struct OperationAborted {};

class UniqueTable {
public:
  static constexpr std::size_t unbounded = static_cast<std::size_t>(-1);

  // `bits`: number of variable pairs; order[k]: bit whose pair is at position k;
  // `cache`: operation cache, which grows with the table.
  UniqueTable(std::uint32_t bits, const std::vector<std::uint32_t> &order, MemoryAccount &account,
              OperationCache &cache);

  struct Node {
    Edge low;
    Edge high;
    std::uint32_t chain; // next node in its bucket or in the free list
    Var var;             // free_var if free
  };

  const Node &node_of(Edge f) const {
    assert(alive(f));
    return nodes_[f >> 1];
  }
  bool alive(Edge f) const { return (f >> 1) < used_ && nodes_[f >> 1].var != free_var; }
  Var var_of(Edge f) const { return node_of(f).var; }
  Edge low_of(Edge f) const { return node_of(f).low ^ (f & 1); }
  Edge high_of(Edge f) const { return node_of(f).high ^ (f & 1); }

  std::uint32_t level(Edge f) const { return level_of_var_[node_of(f).var]; }
  std::uint32_t level_of(Var v) const { return level_of_var_[v]; }
  Var var_at(std::uint32_t level) const { return var_at_level_[level]; }
  std::uint32_t bits() const { return static_cast<std::uint32_t>(level_of_var_.size() / 2); }
  // Number of levels, including the last one for the constant's pseudo-variable.
  std::size_t levels() const { return level_of_var_.size(); }

  // Return the node "if v then high else low", where v is above both operands in the
  // order.  No other function creates nodes.
  Edge make(Var v, Edge low, Edge high);

  // Marks denote nodes in use, or visited by a traversal.
  void clear_marks() { marks_.clear_to_zero(); }
  bool marked(std::uint32_t n) const { return (marks_[n >> 5] >> (n & 31)) & 1; }
  void set_mark(std::uint32_t n) { marks_[n >> 5] |= 1u << (n & 31); }
  void mark(Edge f); // including all descendants
  std::size_t count_marks() const;
  // Free all unmarked nodes.
  void sweep();

  std::size_t live() const { return live_; }
  std::size_t peak() const { return peak_; }
  std::size_t capacity() const { return nodes_.size(); }
  // Let make() throw OperationAborted beyond this many nodes; checked every 4096 nodes.
  void limit_nodes(std::size_t most) { most_nodes_ = most; }
  MemoryAccount &account() { return account_; }

  // Throw std::logic_error if an invariant is violated.
  void assert_consistent() const;

private:
  friend class Sifting; // exchanges levels in place

  static constexpr Var free_var = 0xFFFFFFFF;
  static constexpr std::uint32_t max_nodes = 1u << 28;

  std::size_t bucket(Var v, Edge low, Edge high) const;
  std::uint32_t allocate();
  void grow_nodes();
  void grow_buckets();
  void free_node(std::uint32_t n) {
    nodes_[n] = {0, 0, free_list_, free_var};
    free_list_ = n;
  }

  MemoryAccount &account_;
  OperationCache &cache_;
  CountedArray<Node> nodes_;
  CountedArray<std::uint32_t> buckets_; // first node of each chain, 0 if empty
  CountedArray<std::uint32_t> marks_;
  std::uint32_t used_ = 1;      // end of the nodes that have ever been used
  std::uint32_t free_list_ = 0; // 0 if empty
  std::size_t live_ = 0;
  std::size_t peak_ = 0;
  std::size_t most_nodes_ = unbounded;
  std::vector<std::uint32_t> level_of_var_; // the constant's pseudo-variable is last
  std::vector<Var> var_at_level_;
};

} // namespace slugs
