// From text to a Specification, in either input language.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"
#include "read/messages/diagnostics.hpp"

namespace slugs {

enum class Language { Slugsin, Structured };

// Return the language of a text, by its content: it is structuredslugs as soon
// as it declares an integer or has a formula with an infix operator.  Prefix
// lines are legal in both.
Language language_of(const Source &source);

// Errors and warnings go to `diagnostics`; after an error the result is incomplete
// and must not be used.  Throws LimitReached.
Specification read_specification(const Source &source, Diagnostics &diagnostics,
                                 const Budget &budget = Budget());

} // namespace slugs
