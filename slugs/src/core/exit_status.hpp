// Exit statuses of the command, the one place that knows them.

#pragma once

namespace slugs {

enum class ExitStatus {
  Realizable = 0, // also: certificate accepted, translation done
  Rejected = 1,   // by --check
  BadInput = 2,   // or usage
  Limit = 3,      // time, memory, interrupt
  Internal = 4,   // a bug, or output that could not be written
  Unrealizable = 10
};

} // namespace slugs
