// Extraction of explicit winning strategies of both players.

#pragma once

#include "game/fixpoint.hpp"
#include "game/game.hpp"
#include "strategy/sink.hpp"

#include <cstddef>
#include <cstdint>

namespace slugs {

// Send the nodes to the sink in breadth-first order and count them in `written`.  Only
// their valuations stay in memory, so the output may exceed it.  Throws LimitReached as
// soon as more than `most_nodes` have been found.
void extract_strategy(Game &game, const Fixpoint &fixpoint, std::size_t most_nodes, StrategySink &sink,
                      std::uint64_t &written);

// Extraction of an explicit winning strategy of the environment.

// Send the nodes to the sink in breadth-first order and count them in `written`.  A node is a state with a
// rank, the environment assumption that is pursued.  In each node the environment chooses one next input, the
// lexicographically least that its strategy allows.  The successors of the node are this input with each next
// output that SYS_TRANS allows. In a node without successors the system is deadlocked.
//
// The initial nodes are the lexicographically least initial input for which the system
// loses, with each output that SYS_INIT allows; none if SYS_INIT allows none.
// With robotics_init the environment also chooses the initial outputs: the only
// initial node is the least losing initial state.
//
// `losing`: states from which the system loses, enough for the environment to win
// initially.
void extract_counterstrategy(Game &game, const Bdd &losing, bool robotics_init, StrategySink &sink,
                             std::uint64_t &written);

} // namespace slugs
