// Boolean formulas over the bits of a specification.
//
// Both input languages are translated to them: integers become bits, memory buffers
// become shared nodes.  A pool owns the nodes of one specification as a
// directed acyclic graph.  Nodes are numbered in topological order: the operands
// of a node have smaller ids.
//
// The graph is hash-consed: structurally equal formulas share one id.  In a very
// large pool only formulas created shortly after one another do: looking up each node
// in a table of all nodes would miss the processor's cache for formulas that rarely
// recur.  So equal ids always mean equal formulas; different ids imply nothing, except
// for variables.
//
// The game translates the graph to BDDs.

#pragma once

#include "core/tuning.hpp"

#include <cassert>
#include <cstdint>
#include <deque>
#include <vector>

namespace slugs {

enum class Op : std::uint8_t { False, True, Variable, Not, And, Or, Xor };

using FormulaId = std::uint32_t;

// Packed into eight bytes, since a specification may have tens of millions.
struct FormulaNode {
  static constexpr std::uint32_t most = std::uint32_t{1} << 29; // range of `left`
  FormulaNode(Op o, std::uint32_t l, std::uint32_t r) : op(o), left(l & (most - 1)), right(r) {
    assert(l < most);
  }

  Op op : 3;
  // Variable: left is the index into Specification::variables and right is 1
  // for the next value, 0 for the current one.  Not: left only.
  std::uint32_t left : 29;
  std::uint32_t right;
};

static_assert(sizeof(FormulaNode) == 8);

class FormulaPool {
public:
  explicit FormulaPool(const Tuning &tuning = Tuning());

  // Constructors simplify by constants, idempotence, absorption (f & (f & g)) and
  // double negation, and order the operands of commutative operators.
  FormulaId constant(bool value) const { return value ? 1 : 0; }
  FormulaId variable(std::uint32_t index, bool next);
  FormulaId negation(FormulaId f);
  FormulaId conjunction(FormulaId f, FormulaId g);
  FormulaId disjunction(FormulaId f, FormulaId g);
  FormulaId exclusive_or(FormulaId f, FormulaId g);
  FormulaId implication(FormulaId f, FormulaId g) { return disjunction(negation(f), g); }
  FormulaId equivalence(FormulaId f, FormulaId g) { return negation(exclusive_or(f, g)); }

  const FormulaNode &operator[](FormulaId id) const {
    assert(id < nodes_.size());
    return nodes_[id];
  }
  std::size_t size() const { return nodes_.size(); }

private:
  static constexpr std::size_t first_slots = 64;

  bool contains(Op op, FormulaId whole, FormulaId part) const {
    assert(whole < nodes_.size() && part < nodes_.size());
    const FormulaNode &node = nodes_[whole];
    return node.op == op && (node.left == part || node.right == part);
  }
  FormulaId intern(Op op, std::uint32_t left, std::uint32_t right);
  FormulaId add(const FormulaNode &node);

  // Return the slot that contains the node, or the empty slot where it belongs.
  std::size_t slot_of(const FormulaNode &node, std::uint64_t hash) const;
  void rehash();

  // A search reads nodes only where the tags agree.
  struct Slot {
    std::uint32_t tag;
    FormulaId id; // 0 in an empty slot; constants are not in the table
  };

  std::deque<FormulaNode> nodes_;    // a deque does not move its elements
  std::vector<FormulaId> variables_; // ids by 2 * index + next; 0 if not created yet
  std::vector<Slot> slots_;          // operators from oldest_ on
  FormulaId oldest_ = 0;
  std::size_t used_slots_ = 0; // number of used slots
  std::size_t most_slots_;     // of a table of all formulas
  std::size_t recent_slots_;   // of one of recent formulas, which fits into a core's own cache
};

} // namespace slugs
