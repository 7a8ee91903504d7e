// Memory that is allocated by new, counted and limited: readers and checks of
// certificates use it.
//
// Only the program replaces operator new; the library does not.

#pragma once

#include <cstddef>

namespace slugs {

struct Heap {
  std::size_t used = 0;
  std::size_t limit = static_cast<std::size_t>(-1); // beyond it new throws std::bad_alloc
};

} // namespace slugs
