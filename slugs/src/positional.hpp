// For each guarantee, which transitions the strategy may take towards it.

#pragma once

#include "fixpoint.hpp"
#include "game.hpp"

#include <cstddef>

namespace slugs {

// The transitions from winning states, for the inputs that the environment may
// choose, that the strategy prefers while it pursues guarantee j: for each
// state and input, those of the earliest step of the fixpoint that has any.
Bdd positional_strategy(Game &game, const Bdd &winning, const GoalProgress &progress, std::size_t j);

} // namespace slugs
