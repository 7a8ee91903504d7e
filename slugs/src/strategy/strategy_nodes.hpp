// Incremental breadth-first search of the nodes of the explicit strategy.
//
// Nodes are numbered in the order in which the search finds them: first the initial
// nodes, then the successors of node 0, of node 1, ...

#pragma once

#include "strategy/states/node_table.hpp"
#include "strategy/strategy_steps.hpp"

#include <cstdint>
#include <unordered_map>
#include <vector>

namespace slugs {

class StrategyNodes {
public:
  StrategyNodes(Game &game, StrategySteps &steps);

  // Add the initial nodes; return false, with some missing, if there are more than `most`.
  bool begin(const Bdd &initial, std::size_t most);
  // Return the numbers of the successors of node `id`, valid until the next call.  Call
  // it for all ids in ascending order.
  const std::vector<std::uint64_t> &expand(std::size_t id);

  const NodeTable &nodes() const { return nodes_; } // nodes found so far
  // Check the limits between nodes, and clear caches that have grown too large.
  void collect_if_due();
  void forget(); // clear the cached successor lists

private:
  bool add_initial_nodes(Edge f, std::uint32_t bit, std::vector<Word> &valuation, std::size_t most);
  bool room_to_remember() const;

  struct Key {
    Edge f;
    std::uint32_t rank;
    std::uint32_t signature;
    bool operator==(const Key &o) const { return f == o.f && rank == o.rank && signature == o.signature; }
  };
  struct KeyHash {
    std::size_t operator()(const Key &k) const {
      const Word words[2] = {Word{k.f} << 32 | k.rank, k.signature};
      return static_cast<std::size_t>(hash_words(words, 2, 1));
    }
  };

  Game &game_;
  StrategySteps &steps_;
  NodeTable nodes_;
  std::vector<Word> state_;
  std::unordered_map<Key, std::vector<std::uint64_t>, KeyHash> successors_;
  std::size_t remembered_numbers_ = 0;
};

} // namespace slugs
