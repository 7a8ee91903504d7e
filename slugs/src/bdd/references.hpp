// Reference counts of nodes, including references of handles.  They exist only
// during sifting, which frees a node with its last reference.

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

  // Extend the table to this many nodes; new nodes have no references.
  void resize_for(std::size_t nodes) {
    if (nodes > counts_.size())
      counts_.resize(nodes);
  }
  void add(Edge e) { ++counts_[e >> 1]; }
  // Remove one reference and return whether none is left.
  bool remove(Edge e) {
    assert(counts_[e >> 1] > 0); // else a reference was not counted, or removed twice
    return --counts_[e >> 1] == 0;
  }
  bool has_any(Edge e) const { return counts_[e >> 1] > 0; }

private:
  CountedArray<std::uint32_t> counts_; // indexed by node
};

} // namespace slugs
