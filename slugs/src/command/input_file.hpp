// Reading of input: a whole file, or standard input line by line.

#pragma once

#include "core/budget.hpp"

#include <string>

namespace slugs {

struct FileError : InputOutputError {
  explicit FileError(const std::string &what) : InputOutputError(ExitStatus::BadInput, what) {}
};

// A whole file, or standard input as "-".  Throws FileError with a message that
// names the file and the reason, LimitReached also while it waits for a pipe.
std::string read_file(const std::string &path, const Budget &budget);

// Standard input, line by line.
class InputLines {
public:
  explicit InputLines(const Budget &budget) : budget_(budget) {}
  // False at the end of the input.  Throws FileError, LimitReached.
  bool next(std::string &line);

private:
  Budget budget_;
  std::string text_;
  std::size_t at_ = 0; // start of the text not yet returned
};

} // namespace slugs
