// Reachable states.

#pragma once

#include "game/game.hpp"

namespace slugs {

// Return the states reachable from ENV_INIT & SYS_INIT under the safety constraints of
// both players, and all equivalent states (see Game::with_equivalent).  No play leaves this
// set either, and its diagrams are far smaller if variables only record past events.
Bdd reachable_states(Game &game);

} // namespace slugs
