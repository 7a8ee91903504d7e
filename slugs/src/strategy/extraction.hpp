// The winning strategy as an explicit automaton.

#pragma once

#include "core/statistics.hpp"
#include "game/fixpoint.hpp"
#include "game/game.hpp"
#include "strategy/output/sink.hpp"

#include <cstddef>

namespace slugs {

// Sends the nodes breadth first.  Nothing is kept of what has been sent but the
// valuations of the nodes, so the output may be larger than memory.  Throws
// LimitReached as soon as more than `most_nodes` have been met.
void extract_strategy(Game &game, const Fixpoint &fixpoint, std::size_t most_nodes, StrategySink &sink,
                      Statistics &statistics);

} // namespace slugs
