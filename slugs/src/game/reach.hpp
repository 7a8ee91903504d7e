// The states that a play can visit.

#pragma once

#include "game/game.hpp"

#include <functional>

namespace slugs {

// All states that both players, following their safety constraints only, can
// reach from ENV_INIT & SYS_INIT.  Calls `between_steps` where diagrams may be
// reordered.
Bdd reachable_states(Game &game, const std::function<void()> &between_steps);

} // namespace slugs
