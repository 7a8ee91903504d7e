// Strongly connected components of a strategy's graph (Tarjan, SICOMP 1972).

#pragma once

#include "certificate/graph/strategy_reader.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

// Return for each node the number of its component in the graph of the edges in
// `kept`; edges are numbered as in ExplicitStrategy::successors.  Components
// are numbered from 0; iterative, so that depth costs memory only.
std::vector<std::uint32_t> components(const ExplicitStrategy &graph, const std::vector<bool> &kept,
                                      std::uint32_t &count);

} // namespace slugs
