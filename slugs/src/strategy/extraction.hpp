// Extraction of an explicit winning strategy of the system.

#pragma once

#include "core/statistics.hpp"
#include "game/fixpoint.hpp"
#include "game/game.hpp"
#include "strategy/output/sink.hpp"

#include <cstddef>

namespace slugs {

// Send the nodes to the sink in breadth-first order.  Only their valuations stay in
// memory, so the output may exceed it.  Throws LimitReached as soon as more than
// `most_nodes` have been found.
void extract_strategy(Game &game, const Fixpoint &fixpoint, std::size_t most_nodes, StrategySink &sink,
                      Statistics &statistics);

} // namespace slugs
