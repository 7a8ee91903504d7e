// Independent parts of the environment.
//
// Constraints of ENV_TRANS form a group if they read a common next input, directly or
// through a chain of other constraints.  Given the state, the next inputs of different
// groups are independent.  A group is a part if it has own inputs: inputs whose current
// values are read neither by the rest of ENV_TRANS, nor by SYS_TRANS constraints on
// next outputs, nor by liveness conditions.  Several other robots that move
// independently are such parts.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"
#include "game/analysis/conjuncts.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

struct IndependentPart {
  std::vector<Conjunct> constraints;
  std::vector<std::uint32_t> own; // own inputs, ascending
};

struct Environment {
  std::vector<IndependentPart> parts; // none or at least two
  std::vector<Conjunct> shared;       // the other constraints of ENV_TRANS
};

Environment independent_parts(const Specification &specification, const Conjuncts &conjuncts,
                              const Budget &budget);

} // namespace slugs
