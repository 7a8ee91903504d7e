// The hash-consed pool behind core/formula.hpp.

#include "core/formula.hpp"

#include <utility>

namespace slugs {

std::size_t FormulaPool::KeyHash::operator()(const Key &key) const {
  // Fibonacci hashing: operands are small consecutive numbers, the multiplier
  // spreads them over the high bits, the shift brings those down.
  std::uint64_t h = (key.operands ^ (static_cast<std::uint64_t>(key.op) << 61)) * 0x9E3779B97F4A7C15ull;
  return static_cast<std::size_t>(h ^ (h >> 29));
}

FormulaPool::FormulaPool() {
  nodes_.push_back({Op::False, 0, 0});
  nodes_.push_back({Op::True, 0, 0});
}

FormulaId FormulaPool::intern(Op op, std::uint32_t left, std::uint32_t right) {
  const Key key{(static_cast<std::uint64_t>(left) << 32) | right, op};
  const auto [place, fresh] = ids_.try_emplace(key, static_cast<FormulaId>(nodes_.size()));
  if (fresh)
    nodes_.push_back({op, left, right});
  return place->second;
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
  if (f == 1 || f == g)
    return g;
  return intern(Op::And, f, g);
}

FormulaId FormulaPool::disjunction(FormulaId f, FormulaId g) {
  if (f > g)
    std::swap(f, g);
  if (f == 0 || f == g)
    return g;
  if (f == 1)
    return 1;
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
