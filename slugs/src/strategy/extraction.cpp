// See strategy/extraction.hpp; strategy/strategy_nodes.hpp contains the search.

#include "strategy/extraction.hpp"

#include "strategy/strategy_nodes.hpp"

namespace slugs {

void extract_strategy(Game &game, const Fixpoint &fixpoint, std::size_t most_nodes, StrategySink &sink,
                      Statistics &statistics) {
  const auto limit = [&](bool kept) {
    if (!kept)
      throw LimitReached(LimitKind::Nodes, "node limit reached");
  };
  StrategySteps steps(game, fixpoint);
  const CollectionPause no_collection(game.store);
  steps.prepare();
  StrategyNodes explored(game, steps);
  limit(explored.begin(fixpoint.winning() & game.env_init & game.sys_init, most_nodes));
  sink.begin();
  const NodeTable &nodes = explored.nodes();
  std::vector<bool> bits(game.store.bits());
  for (std::size_t id = 0; id < nodes.size(); ++id) {
    if ((id & 0x3FF) == 0)
      explored.collect_if_due();
    const std::vector<std::uint64_t> &list = explored.expand(id);
    limit(nodes.size() <= most_nodes);
    for (std::size_t k = 0; k < bits.size(); ++k)
      bits[k] = get_bit(nodes.state(id), k);
    sink.node(id, nodes.rank(id), bits, list);
    ++statistics.strategy_nodes;
    statistics.strategy_edges += list.size();
  }
  sink.end();
}

} // namespace slugs
