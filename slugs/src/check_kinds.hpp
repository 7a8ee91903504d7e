// The two checks behind check.hpp, each in a file of its own.

#pragma once

#include "check_model.hpp"

namespace slugs {

// Both throw Rejection.
void check_strategy(CheckModel &model, bool robotics_init);
void check_counterstrategy(CheckModel &model, bool robotics_init);

} // namespace slugs
