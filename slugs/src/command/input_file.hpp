// Reading of a whole file or of standard input.

#pragma once

#include "core/budget.hpp"

#include <string>

namespace slugs {

struct FileError : InputOutputError {
  explicit FileError(const std::string &what) : InputOutputError(ExitStatus::BadInput, what) {}
};

// A whole file, or standard input as "-".  Throws FileError with a message that
// names the file and the reason, LimitReached also while it waits for a pipe and for a
// text larger than the memory limit.
std::string read_file(const std::string &path, const Budget &budget);

} // namespace slugs
