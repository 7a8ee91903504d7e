// From text to a specification.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"
#include "read/diagnostics.hpp"

#include <array>
#include <vector>

namespace slugs {

// The common frame of both languages: lines under section headings.

struct Declaration {
  Owner owner;
  int line;
};

// Line numbers, in the order of the file.  Blank lines, comments and lines
// whose section is unknown are left out.
struct Sections {
  std::vector<Declaration> declarations;
  std::array<std::vector<int>, section_count> constraints;
};

Sections read_sections(const Source &source, Diagnostics &diagnostics);

// From text to a Specification, in either input language.

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
