// The winning strategy of the environment as an explicit automaton.

#pragma once

#include "core/statistics.hpp"
#include "game/game.hpp"
#include "strategy/output/sink.hpp"

namespace slugs {

// Sends the nodes breadth first.  A node is a state with the environment
// assumption that is being pursued, its rank.  In each node the environment has
// chosen one next input, the lexicographically least that its strategy allows;
// the successors of the node all have it, one for each next output that
// SYS_TRANS allows with it.  A node without successors is one where the system
// is stuck.
//
// Initial nodes: the lexicographically least initial input for which the system
// loses, with every output that SYS_INIT allows; none if SYS_INIT allows none.
// With robotics_init, where the environment also chooses the initial outputs,
// the least losing initial state.
//
// `losing` are states that the system loses, enough to lose initially.
void extract_counterstrategy(Game &game, const Bdd &losing, bool robotics_init, StrategySink &sink,
                             Statistics &statistics);

} // namespace slugs
