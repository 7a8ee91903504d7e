// SIGINT, SIGTERM and SIGHUP as a flag that a Budget can watch.
//
// Only the command installs them; the library never touches signals.

#pragma once

#include <atomic>

namespace slugs {

// Installs the handlers: these signals only set the returned flag, and a write
// to a closed pipe fails instead of ending the process.
const std::atomic<bool> &catch_signals();

} // namespace slugs
