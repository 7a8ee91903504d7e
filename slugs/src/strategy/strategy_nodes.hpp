// The nodes of the explicit strategy with their numbers, as far as somebody asks.
//
// Numbers are given in the order in which a first-in first-out search meets the
// nodes: first the initial ones, then the successors of node 0, of node 1, ...

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

  // Meets the initial nodes.  False, and not all of them are met, if there are
  // more than `most`.
  bool begin(const Bdd &initial, std::size_t most);
  // The numbers of the successors of node `id`, for every id from 0 on in turn;
  // valid until the next call.
  const std::vector<std::uint64_t> &leave(std::size_t id);

  const NodeTable &nodes() const { return nodes_; } // those met so far
  // Between nodes: limits, and memory that only speeds things up.
  void make_room();
  void forget(); // what was remembered to be quick

private:
  bool meet_initial(Edge f, std::uint32_t bit, std::vector<Word> &valuation, std::size_t most);
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
  std::unordered_map<Key, std::vector<std::uint64_t>, KeyHash> remembered_;
  std::size_t remembered_numbers_ = 0;
};

} // namespace slugs
