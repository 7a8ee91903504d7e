// Reading a whole file, or standard input as "-".

#pragma once

#include <stdexcept>
#include <string>

namespace slugs {

struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Throws FileError with a message that names the file and the reason.
std::string read_file(const std::string &path);

} // namespace slugs
