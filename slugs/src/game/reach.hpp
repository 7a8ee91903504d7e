// The states that a play can visit.

#pragma once

#include "game/game.hpp"

namespace slugs {

// All states that both players, following their safety constraints only, can
// reach from ENV_INIT & SYS_INIT, and those alike: no play leaves this set either,
// and its diagrams are far smaller where variables say what has just happened.
Bdd reachable_states(Game &game);

// Of these the states that can be reached themselves.
Bdd without_alike(Game &game, const Bdd &reachable);

} // namespace slugs
