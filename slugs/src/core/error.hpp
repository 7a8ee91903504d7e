// Errors that end a run, each with the exit status that tells what they mean.

#pragma once

#include "core/exit_status.hpp"

#include <stdexcept>
#include <string>

namespace slugs {

class Error : public std::runtime_error {
public:
  Error(ExitStatus status, const std::string &what) : std::runtime_error(what), status(status) {}
  // What the command prints: whole lines.
  virtual std::string message() const { return std::string("slugs: ") + what() + '\n'; }

  ExitStatus status;
};

// Something outside that did not do what it was asked: a file, a pipe, a disk.
struct InputOutputError : Error {
  using Error::Error;
};

} // namespace slugs
