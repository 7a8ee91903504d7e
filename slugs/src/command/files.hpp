// Input and output of the command.

#pragma once

#include "core/budget.hpp"

#include <memory>
#include <ostream>
#include <string>

namespace slugs {

// Reading of a whole file or of standard input.

struct FileError : InputOutputError {
  explicit FileError(const std::string &what) : InputOutputError(ExitStatus::BadInput, what) {}
};

// Return a whole file, or standard input as "-".  Throws FileError with a message
// that names the file and the reason, LimitReached even while it waits for a pipe
// and for a text larger than the memory limit.
std::string read_file(const std::string &path, const Budget &budget);

// Output that is either complete or absent.
//
// A file is written under a temporary name beside its own and renamed when it
// is complete, so a crash, a limit or a full disk never leaves a partial file
// under the requested name, and an older file stays until then.  Devices and
// pipes are written directly.

// The output cannot be opened.
struct OpenError : InputOutputError {
  explicit OpenError(const std::string &what) : InputOutputError(ExitStatus::Internal, what) {}
};
// Written data was lost: disk full, closed pipe.
struct WriteError : InputOutputError {
  explicit WriteError(const std::string &what) : InputOutputError(ExitStatus::Internal, what) {}
};

class OutFile {
public:
  // An empty path is standard output.  Throws OpenError.
  explicit OutFile(const std::string &path);
  // Discard the output unless commit() has run.
  ~OutFile();
  OutFile(const OutFile &) = delete;
  OutFile &operator=(const OutFile &) = delete;

  // Throw WriteError as soon as a write fails.
  std::ostream &stream() { return stream_; }
  // Give the file its final name.  Throw WriteError if anything was lost.
  void commit();

private:
  class Buffer;

  std::string path_;      // of the final file, links resolved; empty for standard output
  std::string temporary_; // empty if written directly
  std::unique_ptr<Buffer> buffer_;
  std::ostream stream_;
};

} // namespace slugs
