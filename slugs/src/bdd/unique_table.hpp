// Edges, the operation cache and the unique table.

#pragma once

#include "core/budget.hpp"
#include "core/hash.hpp"

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace slugs {

// Edges and variables.
//
// An edge is twice a node index, plus one if complemented.  Node 0 is the
// constant false, so the edges 0 and 1 are false and true.  Variables come in
// pairs: 2i is the current and 2i + 1 the next value of bit i.

using Edge = std::uint32_t;
using Var = std::uint32_t;
using VarSet = std::uint32_t; // index returned by BddStore::make_set

inline constexpr Edge bdd_false = 0;
inline constexpr Edge bdd_true = 1;

constexpr Var current_var(std::uint32_t bit) { return 2 * bit; }
constexpr Var next_var(std::uint32_t bit) { return 2 * bit + 1; }

// The operation cache, one for all operations: direct-mapped, so a new result
// replaces an old one.  It grows with the unique table.

enum class Operation : std::uint32_t {
  Simplify, // value 0 is safe: its first operand is never constant, so no key is 0
  And,
  Xor,
  Ite,
  Exists,
  AndExists,
  MinusAndExists,
  Shift,
  count
};

class OperationCache {
public:
  explicit OperationCache(MemoryAccount &account);

  // Look up a result and return whether it is cached.
  bool find(Operation op, Edge f, std::uint32_t g, std::uint32_t h, Edge &result) const {
    assert(op < Operation::count);
    const std::uint32_t key = key_of(op, f);
    const Entry &entry = entries_[slot_of(key, g, h)];
    if (entry.f_and_operation != key || entry.g != g || entry.h != h)
      return false;
    result = entry.result;
    return true;
  }
  void add(Operation op, Edge f, std::uint32_t g, std::uint32_t h, Edge result) {
    assert(op < Operation::count && result >> operation_shift == 0);
    const std::uint32_t key = key_of(op, f);
    entries_[slot_of(key, g, h)] = {key, g, h, result};
  }

  void clear() { entries_.clear_to_zero(); }
  // Remove results that refer to dead edges.
  template <typename Dead> void forget(const Dead &dead) {
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      Entry &entry = entries_[i];
      if (!entry.f_and_operation)
        continue;
      const auto op = static_cast<Operation>(entry.f_and_operation >> operation_shift);
      const Edge f = entry.f_and_operation & ((1u << operation_shift) - 1);
      if (dead(f) || dead(entry.result) || (second_is_edge(op) && dead(entry.g)) ||
          (third_is_edge(op) && dead(entry.h)))
        entry = {};
    }
  }
  // Grow to the size suited to this many nodes, if memory allows.
  void fit(std::size_t nodes);

private:
  struct Entry {
    std::uint32_t f_and_operation; // 0 in an empty entry
    std::uint32_t g;
    std::uint32_t h;
    Edge result;
  };
  static constexpr unsigned operation_shift = 29;
  static_assert(static_cast<std::uint32_t>(Operation::count) <= 1u << (32 - operation_shift),
                "the cache key has no bit left for another operation");

  // Other operands are numbers: a set of variables, or the direction of Shift, 0 or 1,
  // which are live as edges.
  static bool second_is_edge(Operation op) { return op != Operation::Exists; }
  static bool third_is_edge(Operation op) { return op == Operation::Ite || op == Operation::MinusAndExists; }
  static std::uint32_t key_of(Operation op, Edge f) {
    assert(f > bdd_true && f >> operation_shift == 0);
    return f | static_cast<std::uint32_t>(op) << operation_shift;
  }
  std::size_t slot_of(std::uint32_t key, std::uint32_t g, std::uint32_t h) const {
    std::uint64_t x = (std::uint64_t{key} << 32 | g) * golden_multiplier;
    x ^= x >> 32;
    x = (x + h) * second_multiplier;
    return static_cast<std::size_t>(x >> 32) & (entries_.size() - 1);
  }

  MemoryAccount &account_;
  CountedArray<Entry> entries_;
};

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
  std::uint32_t level_of(Var v) const {
    assert(v < level_of_var_.size());
    return level_of_var_[v];
  }
  Var var_at(std::uint32_t level) const {
    assert(level < var_at_level_.size());
    return var_at_level_[level];
  }
  std::uint32_t bits() const { return static_cast<std::uint32_t>(level_of_var_.size() / 2); }
  // Number of levels, including the last one for the constant's pseudo-variable.
  std::size_t levels() const { return level_of_var_.size(); }

  // Return the node "if v then high else low", where v is above both operands in the
  // order.  No other function creates nodes.
  Edge make(Var v, Edge low, Edge high);

  // Marks denote nodes in use, or visited by a traversal.
  void clear_marks() { marks_.clear_to_zero(); }
  bool marked(std::uint32_t n) const {
    assert(n < used_);
    return (marks_[n >> 5] >> (n & 31)) & 1;
  }
  void set_mark(std::uint32_t n) {
    assert(n < used_ && nodes_[n].var != free_var);
    marks_[n >> 5] |= 1u << (n & 31);
  }
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
    assert(n > 0 && n < used_); // never the constant
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
