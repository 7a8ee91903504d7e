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

// The same, with the inputs of each independent part of the environment in one
// piece: the first above everything else, all others below.  Given the rest, parts do
// not know of each other, so diagrams grow with their sum; with two of them above the
// rest, with their product.
std::vector<std::uint32_t> start_order(std::size_t variables, const Conjuncts &conjuncts,
                                       const std::vector<IndependentPart> &parts, const Budget &budget);

} // namespace slugs
