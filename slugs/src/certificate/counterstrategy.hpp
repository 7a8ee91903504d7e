// The check of a counterstrategy, see certificate/check.hpp.

#pragma once

#include "certificate/model.hpp"

namespace slugs {

// Throws Rejection.
void check_counterstrategy(CheckModel &model, bool robotics_init);

} // namespace slugs
