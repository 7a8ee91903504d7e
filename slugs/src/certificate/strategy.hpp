// The check of a strategy, see certificate/check.hpp.

#pragma once

#include "certificate/model.hpp"

namespace slugs {

// Throws Rejection.
void check_strategy(CheckModel &model, bool robotics_init);

} // namespace slugs
