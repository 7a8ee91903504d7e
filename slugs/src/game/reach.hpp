// The states that a play can visit.

#pragma once

#include "game/game.hpp"

namespace slugs {

// All states that both players, following their safety constraints only, can
// reach from ENV_INIT & SYS_INIT.
Bdd reachable_states(Game &game);

} // namespace slugs
