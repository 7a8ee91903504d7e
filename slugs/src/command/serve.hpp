// The protocol of --serve: JSON Lines, described in the README.

#pragma once

#include "command/input_file.hpp"
#include "core/specification.hpp"
#include "strategy/on_demand.hpp"

#include <ostream>

namespace slugs {

// Answers requests until they end.
void serve(const Specification &specification, OnDemandStrategy &strategy, InputLines &requests,
           std::ostream &out);

} // namespace slugs
