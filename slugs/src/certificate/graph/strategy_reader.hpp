// An explicit strategy or counterstrategy as a graph.

#pragma once

#include "core/budget.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace slugs {

// Nodes are numbered from 0 in the order of the file.  A successor that names
// no node is `missing`.
struct ExplicitStrategy {
  static constexpr std::uint32_t missing = static_cast<std::uint32_t>(-1);

  std::vector<std::string> variables;   // as printed
  std::vector<std::uint64_t> ids;       // of each node, as printed
  std::vector<std::uint64_t> ranks;     // of each node
  std::vector<std::uint32_t> bit_count; // of each node's state
  std::vector<std::uint64_t> first_bit; // of each node, into bits
  std::vector<bool> bits;               // states in the order of variables

  std::vector<std::uint64_t> first_edge; // one more than nodes
  std::vector<std::uint32_t> successors; // of node n: first_edge[n] .. first_edge[n+1]
  std::vector<std::uint64_t> named;      // the ids of these successors, as printed

  std::size_t size() const { return ids.size(); }
};

// Reads the output of --explicitStrategy --jsonOutput.  Throws JsonError,
// LimitReached.
ExplicitStrategy read_strategy(const std::string &file, std::string_view text,
                               const Budget &budget = Budget());

} // namespace slugs
