// Receiver of an explicit strategy or counterstrategy, node by node, so that a
// strategy larger than memory can be written to a file.

#pragma once

#include <cstdint>
#include <vector>

namespace slugs {

class StrategySink {
public:
  virtual ~StrategySink() = default;
  virtual void begin() = 0;
  // Receive a node.  Ids are consecutive from 0; initial nodes come first.  `state`: one
  // bit per variable in the order of Specification::variables.
  virtual void node(std::uint64_t id, std::uint32_t rank, const std::vector<bool> &state,
                    const std::vector<std::uint64_t> &successors) = 0;
  virtual void end() = 0;
};

} // namespace slugs
