// See certificate/graph/cycles.hpp.

#include "certificate/graph/cycles.hpp"

#include <algorithm>

namespace slugs {

std::vector<std::uint32_t> components(const ExplicitStrategy &graph, const std::vector<bool> &kept,
                                      std::uint32_t &count) {
  constexpr std::uint32_t unseen = static_cast<std::uint32_t>(-1);
  const std::size_t nodes = graph.size();
  std::vector<std::uint32_t> component(nodes, unseen);
  std::vector<std::uint32_t> entered(nodes, unseen); // order of discovery
  std::vector<std::uint32_t> lowest(nodes);          // reachable on the stack
  std::vector<std::uint32_t> stack;
  struct Visit {
    std::uint32_t node;
    std::uint64_t edge;
  };
  std::vector<Visit> visits;
  std::uint32_t clock = 0;
  count = 0;

  const auto enter = [&](std::uint32_t node) {
    entered[node] = lowest[node] = clock++;
    stack.push_back(node);
    visits.push_back({node, graph.first_edge[node]});
  };
  for (std::uint32_t root = 0; root < nodes; ++root) {
    if (entered[root] != unseen)
      continue;
    enter(root);
    while (!visits.empty()) {
      const std::uint32_t node = visits.back().node;
      if (visits.back().edge < graph.first_edge[node + 1]) {
        const std::uint64_t edge = visits.back().edge++;
        if (!kept[edge])
          continue;
        const std::uint32_t next = graph.successors[edge];
        if (entered[next] == unseen)
          enter(next);
        else if (component[next] == unseen)
          lowest[node] = std::min(lowest[node], entered[next]);
        continue;
      }
      visits.pop_back();
      if (!visits.empty())
        lowest[visits.back().node] = std::min(lowest[visits.back().node], lowest[node]);
      if (lowest[node] != entered[node])
        continue;
      while (component[node] == unseen) {
        component[stack.back()] = count;
        stack.pop_back();
      }
      ++count;
    }
  }
  return component;
}

} // namespace slugs
