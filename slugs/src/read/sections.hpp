// The common frame of both languages: lines under section headings.

#pragma once

#include "core/specification.hpp"
#include "read/messages/diagnostics.hpp"

#include <array>
#include <vector>

namespace slugs {

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

} // namespace slugs
