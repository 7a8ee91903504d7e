// The command line: one table of options, from which parsing, help and
// suggestions come.

#pragma once

#include "core/budget.hpp"

#include <cstddef>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace slugs {

struct Options {
  bool explicit_strategy = false;
  bool json_output = false;
  bool counter_strategy = false;
  bool robotics_init = false;
  bool bias_for_action = false;
  bool realizability = false;
  bool translate = false;
  bool help = false;
  bool version = false;
  std::optional<double> timeout_seconds;
  std::optional<std::size_t> memory_megabytes;
  std::optional<std::size_t> most_nodes; // of an explicit strategy
  std::string file;                      // "-" for standard input
  std::string outfile;                   // empty for standard output
};

class UsageError : public Error {
public:
  UsageError(const std::string &message, std::string hint = "")
      : Error(ExitStatus::BadInput, message), hint_(std::move(hint)) {}
  std::string message() const override;

private:
  std::string hint_;
};

// `arguments` without the program's name.  Throws UsageError.
Options parse_options(const std::vector<std::string> &arguments);

void print_help(std::ostream &out);

// The version of the program, defined by the CMake project.

extern const char *const version;

} // namespace slugs
