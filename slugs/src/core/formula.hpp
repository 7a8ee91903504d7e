// Boolean formulas over the bits of a specification.
//
// Both input languages end here: integers have become bits, buffers have
// become shared nodes.  A pool owns the nodes of one specification as a
// hash-consed directed acyclic graph, so equal formulas have equal ids and a
// sub-formula that occurs a thousand times is stored once.  Nodes are numbered
// in topological order: the operands of a node have smaller ids.
//
// The graph is the only thing that the game (which turns it into BDDs) and the
// checker (which evaluates it on states) have in common.

#pragma once

#include <cassert>
#include <cstdint>
#include <vector>

namespace slugs {

enum class Op : std::uint8_t { False, True, Variable, Not, And, Or, Xor };

using FormulaId = std::uint32_t;

struct FormulaNode {
  Op op;
  // Variable: left is the index into Specification::variables and right is 1
  // for the next value, 0 for the current one.  Not: left only.
  std::uint32_t left;
  std::uint32_t right;
};

class FormulaPool {
public:
  FormulaPool();

  // Constructors simplify by constants, idempotence, absorption (f & (f & g)) and
  // double negation, and order the operands of commutative operators.
  FormulaId constant(bool value) const { return value ? 1 : 0; }
  FormulaId variable(std::uint32_t index, bool next);
  FormulaId negation(FormulaId f);
  FormulaId conjunction(FormulaId f, FormulaId g);
  FormulaId disjunction(FormulaId f, FormulaId g);
  FormulaId exclusive(FormulaId f, FormulaId g);
  FormulaId implication(FormulaId f, FormulaId g) { return disjunction(negation(f), g); }
  FormulaId equivalence(FormulaId f, FormulaId g) { return negation(exclusive(f, g)); }

  const FormulaNode &operator[](FormulaId id) const {
    assert(id < nodes_.size());
    return nodes_[id];
  }
  std::size_t size() const { return nodes_.size(); }

private:
  bool contains(Op op, FormulaId whole, FormulaId part) const {
    const FormulaNode &node = nodes_[whole];
    return node.op == op && (node.left == part || node.right == part);
  }
  FormulaId intern(Op op, std::uint32_t left, std::uint32_t right);

  // Where the node is, or the empty place where it belongs.
  std::size_t place_of(const FormulaNode &node, std::uint64_t hash) const;
  void grow();

  // A search compares tags and looks at nodes only where they agree: nodes are many
  // and far apart, and each look is a cache miss.
  struct Slot {
    std::uint32_t tag;
    FormulaId id; // 0 in an empty slot, since constants are not in it
  };

  std::vector<FormulaNode> nodes_;
  std::vector<Slot> slots_;
};

} // namespace slugs
