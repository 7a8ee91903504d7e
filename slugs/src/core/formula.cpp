// The hash-consed pool.

#include "core/formula.hpp"

#include "core/hash.hpp"

#include <algorithm>
#include <cassert>
#include <new>
#include <utility>

namespace slugs {

namespace {

// Operands are small consecutive numbers.  The first step spreads them over the
// high bits, the second over all bits, since linear probing degrades with clusters.
std::uint64_t hash(const FormulaNode &node) {
  const std::uint64_t operands = static_cast<std::uint64_t>(node.left) << 32 | node.right;
  std::uint64_t h = (operands ^ static_cast<std::uint64_t>(node.op) << 61) * golden_multiplier;
  h ^= h >> 32;
  h *= second_multiplier;
  return h ^ h >> 32;
}

std::uint32_t tag_of(std::uint64_t hash) { return static_cast<std::uint32_t>(hash >> 32); }

} // namespace

FormulaPool::FormulaPool(const Tuning &tuning)
    : slots_(first_slots), most_slots_(tuning.pool_slots), recent_slots_(tuning.pool_recent) {
  assert((most_slots_ & (most_slots_ - 1)) == 0 && (recent_slots_ & (recent_slots_ - 1)) == 0);
  nodes_.push_back({Op::False, 0, 0});
  nodes_.push_back({Op::True, 0, 0});
  assert(nodes_[constant(false)].op == Op::False && nodes_[constant(true)].op == Op::True);
}

FormulaId FormulaPool::add(const FormulaNode &node) {
  if (nodes_.size() == FormulaNode::most)
    throw std::bad_alloc();
  nodes_.push_back(node);
  return static_cast<FormulaId>(nodes_.size() - 1);
}

FormulaId FormulaPool::intern(Op op, std::uint32_t left, std::uint32_t right) {
  // Operands precede their operator, so a traversal in order needs no recursion.
  assert(left < nodes_.size() && right < nodes_.size());
  assert(op >= Op::Not && left > 1 && (op == Op::Not || left < right)); // in normal form
  const FormulaNode node{op, left, right};
  const std::uint64_t h = hash(node);
  Slot &slot = slots_[slot_of(node, h)];
  if (slot.id)
    return slot.id;
  const FormulaId id = add(node);
  slot = {tag_of(h), id};
  assert(nodes_[id].op == op && nodes_[id].left == left && nodes_[id].right == right);
  if (3 * ++used_slots_ > 2 * slots_.size())
    rehash();
  return id;
}

// Open addressing.  Single entries are never removed, so an empty slot ends the search.
std::size_t FormulaPool::slot_of(const FormulaNode &node, std::uint64_t hash) const {
  const std::size_t last = slots_.size() - 1;
  assert((slots_.size() & last) == 0 && used_slots_ < slots_.size());
  const std::uint32_t tag = tag_of(hash);
  for (std::size_t place = hash & last;; place = (place + 1) & last) {
    const Slot &slot = slots_[place];
    if (!slot.id)
      return place;
    if (slot.tag != tag)
      continue;
    const FormulaNode &known = nodes_[slot.id];
    if (known.op == node.op && known.left == node.left && known.right == node.right)
      return place;
  }
}

// Double the table, or clear it at its maximum size: then only later formulas are found.
void FormulaPool::rehash() {
  const bool forget = slots_.size() >= most_slots_;
  const std::size_t size = forget ? recent_slots_ : 2 * slots_.size();
  slots_ = std::vector<Slot>(); // free the old table before allocating the new one
  slots_.resize(size);
  if (forget) {
    most_slots_ = recent_slots_;
    oldest_ = static_cast<FormulaId>(nodes_.size());
    used_slots_ = 0;
  }
  assert(oldest_ <= nodes_.size());
  for (FormulaId id = oldest_; id < nodes_.size(); ++id) {
    const FormulaNode &node = nodes_[id];
    if (node.op < Op::Not)
      continue;
    const std::uint64_t h = hash(node);
    slots_[slot_of(node, h)] = {tag_of(h), id};
  }
}

FormulaId FormulaPool::variable(std::uint32_t index, bool next) {
  const std::size_t place = 2 * std::size_t{index} + (next ? 1 : 0);
  if (place >= variables_.size())
    variables_.resize(std::max(place + 1, 2 * variables_.size()));
  if (!variables_[place])
    variables_[place] = add({Op::Variable, index, next ? 1u : 0u});
  assert(nodes_[variables_[place]].op == Op::Variable && nodes_[variables_[place]].left == index);
  return variables_[place];
}

FormulaId FormulaPool::negation(FormulaId f) {
  assert(f < nodes_.size());
  if (f <= 1)
    return 1 - f;
  if (nodes_[f].op == Op::Not)
    return nodes_[f].left;
  return intern(Op::Not, f, 0);
}

FormulaId FormulaPool::conjunction(FormulaId f, FormulaId g) {
  assert(f < nodes_.size() && g < nodes_.size());
  if (f > g)
    std::swap(f, g);
  if (f == 0)
    return 0;
  if (f == 1 || f == g || contains(Op::And, g, f))
    return g;
  return intern(Op::And, f, g);
}

FormulaId FormulaPool::disjunction(FormulaId f, FormulaId g) {
  assert(f < nodes_.size() && g < nodes_.size());
  if (f > g)
    std::swap(f, g);
  if (f == 1)
    return 1;
  if (f == 0 || f == g || contains(Op::Or, g, f))
    return g;
  return intern(Op::Or, f, g);
}

FormulaId FormulaPool::exclusive_or(FormulaId f, FormulaId g) {
  assert(f < nodes_.size() && g < nodes_.size());
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
