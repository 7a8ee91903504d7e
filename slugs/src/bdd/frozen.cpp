// Copying a diagram out of the store and rebuilding it.

#include "bdd/frozen.hpp"

#include "bdd/edge_table.hpp"

#include <vector>

namespace slugs {

FrozenBdd::FrozenBdd(BddStore &store, const Bdd &f) : nodes_(store.account()) {
  const Operations &edges = store.edges();
  std::vector<Node> list;
  EdgeTable<std::uint32_t> places(store.account()); // positions in `list`, from 1, by node
  const auto visit = [&](const auto &self, Edge e) -> Edge {
    if (edges.is_terminal(e))
      return e;
    const Edge regular = e & ~1u;
    if (const std::uint32_t *known = places.find(regular >> 1))
      return *known << 1 | (e & 1);
    const Edge low = self(self, edges.low_of(regular));
    const Edge high = self(self, edges.high_of(regular));
    list.push_back({edges.var_of(regular), low, high});
    const auto place = static_cast<std::uint32_t>(list.size());
    places.add(regular >> 1, place);
    return place << 1 | (e & 1);
  };
  root_ = visit(visit, f.edge());
  nodes_.resize(list.size());
  for (std::size_t i = 0; i < list.size(); ++i)
    nodes_[i] = list[i];
}

Bdd FrozenBdd::thaw(BddStore &store) const {
  store.collect_or_reorder_if_due();
  std::vector<Edge> built(nodes_.size() + 1, bdd_false);
  const auto edge = [&](Edge e) { return built[e >> 1] ^ (e & 1); };
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    built[i + 1] = store.edges().branch(nodes_[i].var, edge(nodes_[i].low), edge(nodes_[i].high));
  return Bdd(store, edge(root_));
}

} // namespace slugs
