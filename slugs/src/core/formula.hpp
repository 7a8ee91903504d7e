// Boolean formulas over the bits of a specification.
//
// Both input languages end here: integers have become bits, buffers have
// become shared nodes.  A pool owns the nodes of one specification as a
// directed acyclic graph.  Nodes are numbered in topological order: the operands
// of a node have smaller ids.
//
// The graph is hash-consed: equal formulas have equal ids, and a sub-formula that
// occurs a thousand times is stored once.  That holds of all formulas in a pool of
// ordinary size.  In a very large one it holds of those that are made soon after one
// another: a table of all nodes would be a cache miss for each of them, for formulas
// that hardly ever come again.  So equal ids mean equal formulas, always, and different
// ids mean nothing, except those of variables.
//
// The graph is the only thing that the game (which turns it into BDDs) and the
// checker (which evaluates it on states) have in common.

#pragma once

#include <cassert>
#include <cstdint>
#include <deque>
#include <vector>

namespace slugs {

enum class Op : std::uint8_t { False, True, Variable, Not, And, Or, Xor };

using FormulaId = std::uint32_t;

// In eight bytes: there may be tens of millions.
struct FormulaNode {
  static constexpr std::uint32_t most = std::uint32_t{1} << 29; // what `left` can hold
  FormulaNode(Op o, std::uint32_t l, std::uint32_t r) : op(o), left(l & (most - 1)), right(r) {}

  Op op : 3;
  // Variable: left is the index into Specification::variables and right is 1
  // for the next value, 0 for the current one.  Not: left only.
  std::uint32_t left : 29;
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

  // From now on equal formulas have equal ids, however many there will be.
  void remember_all() { most_slots_ = static_cast<std::size_t>(-1); }

private:
  static constexpr std::size_t first_slots = 64;
  static constexpr std::size_t ordinary_slots = std::size_t{1} << 20; // of all formulas
  static constexpr std::size_t recent_slots = std::size_t{1} << 16;   // fits into a core's own cache

  bool contains(Op op, FormulaId whole, FormulaId part) const {
    const FormulaNode &node = nodes_[whole];
    return node.op == op && (node.left == part || node.right == part);
  }
  FormulaId intern(Op op, std::uint32_t left, std::uint32_t right);
  FormulaId add(const FormulaNode &node);

  // Where the node is, or the empty place where it belongs.
  std::size_t place_of(const FormulaNode &node, std::uint64_t hash) const;
  void make_room();

  // A search compares tags and looks at nodes only where they agree.
  struct Slot {
    std::uint32_t tag;
    FormulaId id; // 0 in an empty slot, since constants are not in it
  };

  std::deque<FormulaNode> nodes_;    // which never have to move
  std::vector<FormulaId> variables_; // by index and next; 0 where there is none yet
  std::vector<Slot> slots_;          // operators from oldest_ on
  FormulaId oldest_ = 0;
  std::size_t remembered_ = 0; // how many
  std::size_t most_slots_ = ordinary_slots;
};

} // namespace slugs
