// The hash-consed pool behind core/formula.hpp.

#include "core/formula.hpp"

#include "core/hash.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace slugs {

namespace {

// Operands are small consecutive numbers: the first step spreads them over the
// high bits, the second over all; linear probing suffers from any clusters.
std::uint64_t hash(const FormulaNode &node) {
  const std::uint64_t operands = std::uint64_t{node.left} << 32 | node.right;
  std::uint64_t h = (operands ^ static_cast<std::uint64_t>(node.op) << 61) * golden_multiplier;
  h ^= h >> 32;
  h *= second_multiplier;
  return h ^ h >> 32;
}

std::uint32_t tag_of(std::uint64_t hash) { return static_cast<std::uint32_t>(hash >> 32); }

} // namespace

FormulaPool::FormulaPool() : slots_(64) {
  nodes_.push_back({Op::False, 0, 0});
  nodes_.push_back({Op::True, 0, 0});
}

FormulaId FormulaPool::intern(Op op, std::uint32_t left, std::uint32_t right) {
  // Operands come first, so whoever goes through the nodes in order needs no recursion.
  assert(op == Op::Variable || (left < nodes_.size() && right < nodes_.size()));
  const FormulaNode node{op, left, right};
  const std::uint64_t h = hash(node);
  Slot &slot = slots_[place_of(node, h)];
  if (slot.id)
    return slot.id;
  const auto id = static_cast<FormulaId>(nodes_.size());
  slot = {tag_of(h), id};
  nodes_.push_back(node);
  if (3 * nodes_.size() > 2 * slots_.size())
    grow();
  return id;
}

// Open addressing in two steps.  A parser makes the operands of a node right before
// it, so what has a late operand is first looked for where that is in the table: one
// formula after another, and not one cache miss each.  Nothing is ever removed, so an
// empty slot ends the search; where that neighbourhood is full, all of the table
// follows.
std::size_t FormulaPool::place_of(const FormulaNode &node, std::uint64_t hash) const {
  constexpr std::size_t neighbourhood = 8;
  const std::size_t last = slots_.size() - 1;
  const std::uint32_t tag = tag_of(hash);
  const auto fits = [&](std::size_t place) {
    const Slot &slot = slots_[place];
    if (!slot.id)
      return true;
    if (slot.tag != tag)
      return false;
    const FormulaNode &known = nodes_[slot.id];
    return known.op == node.op && known.left == node.left && known.right == node.right;
  };
  const std::size_t operand = std::max(node.left, node.right);
  const std::size_t near = (operand + operand / 2) & last & ~(neighbourhood - 1); // all of the table
  for (std::size_t place = near; place < near + neighbourhood; ++place)
    if (fits(place))
      return place;
  std::size_t place = hash & last;
  while (!fits(place))
    place = (place + 1) & last;
  return place;
}

void FormulaPool::grow() {
  const std::size_t size = 2 * slots_.size();
  slots_ = std::vector<Slot>(); // before the larger table is there
  slots_.resize(size);
  for (std::size_t id = 2; id < nodes_.size(); ++id) {
    const std::uint64_t h = hash(nodes_[id]);
    slots_[place_of(nodes_[id], h)] = {tag_of(h), static_cast<FormulaId>(id)};
  }
}

FormulaId FormulaPool::variable(std::uint32_t index, bool next) {
  return intern(Op::Variable, index, next ? 1 : 0);
}

FormulaId FormulaPool::negation(FormulaId f) {
  if (f <= 1)
    return 1 - f;
  if (nodes_[f].op == Op::Not)
    return nodes_[f].left;
  return intern(Op::Not, f, 0);
}

FormulaId FormulaPool::conjunction(FormulaId f, FormulaId g) {
  if (f > g)
    std::swap(f, g);
  if (f == 0)
    return 0;
  if (f == 1 || f == g || contains(Op::And, g, f))
    return g;
  return intern(Op::And, f, g);
}

FormulaId FormulaPool::disjunction(FormulaId f, FormulaId g) {
  if (f > g)
    std::swap(f, g);
  if (f == 1)
    return 1;
  if (f == 0 || f == g || contains(Op::Or, g, f))
    return g;
  return intern(Op::Or, f, g);
}

FormulaId FormulaPool::exclusive(FormulaId f, FormulaId g) {
  if (f > g)
    std::swap(f, g);
  if (f == g)
    return 0;
  if (f == 0)
    return g;
  if (f == 1)
    return negation(g);
  return intern(Op::Xor, f, g);
}

} // namespace slugs
