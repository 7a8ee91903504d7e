// The start order of the variables.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"
#include "game/conjuncts.hpp"
#include "game/independent_parts.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

// An order in which variables that share constraints are close: order[k] is the
// variable at position k.
std::vector<std::uint32_t> force_order(std::size_t variables, const Conjuncts &conjuncts,
                                       const Budget &budget);

// The order with its hubs at the top: the variables that more than eight times as many
// constraints read as the median one. FORCE puts them in the middle of what they are
// read with, and diagrams have to remember all above them: the position of a lift among
// its buttons tells which button matters, once it is known.
std::vector<std::uint32_t> hubs_first(std::vector<std::uint32_t> order, const Conjuncts &conjuncts);

// The order of FORCE with its hubs first, and the inputs of each independent part of the
// environment in one piece: the first above everything else, all others below.  Given
// the rest, parts do not know of each other, so diagrams grow with their sum; with two
// of them above the rest, with their product.
std::vector<std::uint32_t> start_order(std::size_t variables, const Conjuncts &conjuncts,
                                       const std::vector<IndependentPart> &parts, const Budget &budget);

} // namespace slugs
