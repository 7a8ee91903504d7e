// The command line program as a function, which main() calls.

#pragma once

#include "core/exit_status.hpp"

#include <string>
#include <vector>

namespace slugs {

// `arguments` without the program's name.  Catches everything.
ExitStatus run_command(const std::vector<std::string> &arguments);

} // namespace slugs
