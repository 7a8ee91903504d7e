// The command line program as a function, which main() calls.

#pragma once

#include "command/heap.hpp"
#include "core/exit_status.hpp"

#include <string>
#include <vector>

namespace slugs {

// `arguments` without the program's name.  Catches everything.  `heap` counts
// what the program allocates, and gets the limit of --memory.
ExitStatus run_command(const std::vector<std::string> &arguments, Heap &heap);

} // namespace slugs
