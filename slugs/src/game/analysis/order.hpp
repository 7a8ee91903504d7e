// The initial variable order.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"
#include "game/analysis/conjuncts.hpp"
#include "game/analysis/independent_parts.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

// Return an order that places variables of the same constraint near each other:
// order[k] is the variable at position k.
std::vector<std::uint32_t> force_order(std::size_t variables, const Conjuncts &conjuncts,
                                       const Budget &budget);

// Move hubs to the top: variables with more than eight times as many occurrences as the
// median variable.  FORCE places them amid the variables that they interact with, and
// diagrams must then encode all variables above them.  For example, the position of a
// lift selects the relevant button, so it belongs above the buttons.
std::vector<std::uint32_t> hubs_first(std::vector<std::uint32_t> order, const Conjuncts &conjuncts);

// Return the order of FORCE with hubs first and the inputs of each independent part of
// the environment contiguous: the first part above all shared variables, the others
// below.  Given the shared variables, parts are independent, so the size of diagrams
// grows with the sum of the parts' sizes; with two parts above the shared variables it
// would grow with their product.
std::vector<std::uint32_t> start_order(std::size_t variables, const Conjuncts &conjuncts,
                                       const std::vector<IndependentPart> &parts, const Budget &budget);

} // namespace slugs
