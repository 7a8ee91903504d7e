// Writing a diagram down and building it again.

#include "frozen_bdd.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

namespace {

// Positions of nodes: a hash table with nothing but what that takes, for a
// fixpoint puts aside thousands of diagrams.
class Positions {
public:
  Positions() : slots_(64) {}
  // 0 if unknown.
  std::uint32_t of(std::uint32_t node) const { return slots_[find(node)].position; }
  void add(std::uint32_t node, std::uint32_t position) {
    if (2 * ++count_ > slots_.size()) {
      std::vector<Slot> old(2 * slots_.size());
      old.swap(slots_);
      for (const Slot &slot : old)
        if (slot.position)
          slots_[find(slot.node)] = slot;
    }
    slots_[find(node)] = {node, position};
  }

private:
  struct Slot {
    std::uint32_t node = 0;
    std::uint32_t position = 0; // 0 in an empty slot
  };
  std::size_t find(std::uint32_t node) const {
    std::size_t slot = (node * 0x9E3779B97F4A7C15ull >> 32) & (slots_.size() - 1);
    while (slots_[slot].position && slots_[slot].node != node)
      slot = (slot + 1) & (slots_.size() - 1);
    return slot;
  }
  std::vector<Slot> slots_;
  std::size_t count_ = 0;
};

} // namespace

FrozenBdd::FrozenBdd(BddStore &store, const Bdd &f) : nodes_(store.account()) {
  std::vector<Node> list;
  Positions positions;
  const auto visit = [&](const auto &self, Edge e) -> Edge {
    if (store.is_terminal(e))
      return e;
    const Edge regular = e & ~1u;
    std::uint32_t place = positions.of(regular >> 1);
    if (!place) {
      const Edge low = self(self, store.low_of(regular));
      const Edge high = self(self, store.high_of(regular));
      list.push_back({store.var_of(regular), low, high});
      place = static_cast<std::uint32_t>(list.size());
      positions.add(regular >> 1, place);
    }
    return place << 1 | (e & 1);
  };
  root_ = visit(visit, f.edge());
  nodes_.resize(list.size());
  for (std::size_t i = 0; i < list.size(); ++i)
    nodes_[i] = list[i];
}

Bdd FrozenBdd::thaw(BddStore &store) const {
  store.make_room();
  std::vector<Edge> built(nodes_.size() + 1, bdd_false);
  const auto edge = [&](Edge e) { return built[e >> 1] ^ (e & 1); };
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    built[i + 1] = store.branch_edge(nodes_[i].var, edge(nodes_[i].low), edge(nodes_[i].high));
  return Bdd(store, edge(root_));
}

} // namespace slugs
