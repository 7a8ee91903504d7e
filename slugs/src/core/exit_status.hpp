// Exit statuses of the command.

#pragma once

namespace slugs {

enum class ExitStatus {
  Realizable = 0, // also: translation done
  BadInput = 2,   // invalid input or usage
  Limit = 3,      // time limit, memory limit or interrupt
  Internal = 4,   // bug, or output that could not be written
  Unrealizable = 10
};

} // namespace slugs
