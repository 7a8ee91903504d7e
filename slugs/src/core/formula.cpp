// The hash-consed pool behind core/formula.hpp.

#include "core/formula.hpp"

#include "core/hash.hpp"

#include <cassert>
#include <utility>

namespace slugs {

namespace {

// Operands are small consecutive numbers: the first step spreads them over the
// high bits, the second over all; linear probing suffers from any clusters.
std::size_t hash(const FormulaNode &node) {
  const std::uint64_t operands = std::uint64_t{node.left} << 32 | node.right;
  std::uint64_t h = (operands ^ static_cast<std::uint64_t>(node.op) << 61) * golden_multiplier;
  h ^= h >> 32;
  h *= second_multiplier;
  return static_cast<std::size_t>(h >> 32);
}

} // namespace

FormulaPool::FormulaPool() : slots_(64) {
  nodes_.push_back({Op::False, 0, 0});
  nodes_.push_back({Op::True, 0, 0});
}

FormulaId FormulaPool::intern(Op op, std::uint32_t left, std::uint32_t right) {
  // Operands come first, so whoever goes through the nodes in order needs no recursion.
  assert(op == Op::Variable || (left < nodes_.size() && right < nodes_.size()));
  const FormulaNode node{op, left, right};
  std::size_t slot = hash(node) & (slots_.size() - 1);
  for (; slots_[slot]; slot = (slot + 1) & (slots_.size() - 1)) {
    const FormulaNode &known = nodes_[slots_[slot]];
    if (known.op == op && known.left == left && known.right == right)
      return slots_[slot];
  }
  const auto id = static_cast<FormulaId>(nodes_.size());
  nodes_.push_back(node);
  slots_[slot] = id;
  if (2 * nodes_.size() > slots_.size())
    grow();
  return id;
}

void FormulaPool::grow() {
  const std::size_t size = 2 * slots_.size();
  slots_ = std::vector<FormulaId>(); // before the larger table is there
  slots_.resize(size);
  for (std::size_t id = 2; id < nodes_.size(); ++id) {
    std::size_t slot = hash(nodes_[id]) & (size - 1);
    while (slots_[slot])
      slot = (slot + 1) & (size - 1);
    slots_[slot] = static_cast<FormulaId>(id);
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
