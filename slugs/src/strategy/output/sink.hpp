// Where extraction sends an explicit strategy or counterstrategy, node by node,
// so that a strategy larger than memory can stream to a file.

#pragma once

#include <cstdint>
#include <vector>

namespace slugs {

class StrategySink {
public:
  virtual ~StrategySink() = default;
  virtual void begin() = 0;
  // Nodes come with ids 0, 1, 2, ... in this order.  `state` holds one bit per
  // variable in the order of Specification::variables.  Initial nodes come first.
  virtual void node(std::uint64_t id, std::uint32_t rank, const std::vector<bool> &state,
                    const std::vector<std::uint64_t> &successors) = 0;
  virtual void end() = 0;
};

} // namespace slugs
