// SIGINT, SIGTERM and SIGHUP as a flag that a Budget can watch.
//
// Only the command installs them; the library never touches signals.

#pragma once

#include <atomic>

namespace slugs {

// From now on an interrupt sets the flag and nothing else, and writing to a
// closed pipe is an error of the write instead of the end of the process.
const std::atomic<bool> &catch_signals();

} // namespace slugs
