// Errors that end a run, each with its exit status.

#pragma once

#include "core/exit_status.hpp"

#include <stdexcept>
#include <string>

namespace slugs {

class Error : public std::runtime_error {
public:
  Error(ExitStatus status, const std::string &what) : std::runtime_error(what), status(status) {}
  // Return the text that the command prints: complete lines.
  virtual std::string message() const { return std::string("slugs: ") + what() + '\n'; }

  ExitStatus status;
};

// Failure of a file, a pipe or a disk.
struct InputOutputError : Error {
  using Error::Error;
};

} // namespace slugs
