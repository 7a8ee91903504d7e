// Any specification as slugsin, for the tools that read only that.
//
// Variables and constraints keep their order, integers become their bits and
// range limits, and a formula that a line uses more than once is written once,
// as an entry of a memory buffer.  Reading the result gives the same game with
// the same order of variables, hence the same strategy.

#pragma once

#include "core/specification.hpp"

#include <iosfwd>

namespace slugs {

void translate(const Specification &specification, std::ostream &out);

} // namespace slugs
