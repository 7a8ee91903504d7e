// The parts of the environment that move independently of each other.
//
// Constraints of ENV_TRANS belong together if they refer to the same next input, or
// of two that some other constraint brings together.  What the inputs of one group
// do next then says nothing about those of another.  Such a group is a part if it
// has a present of its own: inputs whose present values matter for nothing else,
// neither for the rest of ENV_TRANS, nor for which answers the system has, nor for
// liveness.  Several other robots on their own ways are such parts.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"
#include "game/conjuncts.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

struct IndependentPart {
  std::vector<Conjunct> constraints;
  std::vector<std::uint32_t> own; // inputs, ascending
};

struct Environment {
  std::vector<IndependentPart> parts; // none or at least two
  std::vector<Conjunct> shared;       // the other constraints of ENV_TRANS
};

Environment independent_parts(const Specification &specification, const Conjuncts &conjuncts,
                              const Budget &budget);

} // namespace slugs
