// How many edges lead to each node, those of handles included: while diagrams are
// sifted, a node dies with the last of them.

#pragma once

#include "bdd/edge.hpp"
#include "core/counted_array.hpp"

#include <cassert>
#include <cstddef>
#include <cstdint>

namespace slugs {

class References {
public:
  explicit References(MemoryAccount &account) : counts_(account) {}

  // Makes place for so many nodes; those that are new have no reference.
  void cover(std::size_t nodes) {
    if (nodes > counts_.size())
      counts_.resize(nodes);
  }
  void add(Edge e) { ++counts_[e >> 1]; }
  // Whether none is left.
  bool remove_last(Edge e) {
    assert(counts_[e >> 1] > 0); // else an edge was lost, or is followed twice
    return --counts_[e >> 1] == 0;
  }
  bool has_any(Edge e) const { return counts_[e >> 1] > 0; }

private:
  CountedArray<std::uint32_t> counts_; // by node
};

} // namespace slugs
