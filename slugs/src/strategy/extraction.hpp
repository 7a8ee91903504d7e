// The winning strategy as an explicit automaton.

#pragma once

#include "core/statistics.hpp"
#include "game/fixpoint.hpp"
#include "game/game.hpp"
#include "strategy/sink.hpp"

namespace slugs {

// Sends the nodes breadth first.  Nothing is kept of what has been sent but the
// valuations of the nodes, so the output may be larger than memory.
void extract_strategy(Game &game, const Fixpoint &fixpoint, StrategySink &sink, Statistics &statistics);

} // namespace slugs
