// Extraction of an explicit winning strategy of the system.

#pragma once

#include "game/fixpoint.hpp"
#include "game/game.hpp"
#include "strategy/output/sink.hpp"

#include <cstddef>
#include <cstdint>

namespace slugs {

// Send the nodes to the sink in breadth-first order and count them in `written`.  Only
// their valuations stay in memory, so the output may exceed it.  Throws LimitReached as
// soon as more than `most_nodes` have been found.
void extract_strategy(Game &game, const Fixpoint &fixpoint, std::size_t most_nodes, StrategySink &sink,
                      std::uint64_t &written);

} // namespace slugs
