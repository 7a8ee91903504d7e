// Output of an explicit strategy as JSON, in the format of SLUGS with --jsonOutput.

#pragma once

#include "core/output_buffer.hpp"
#include "core/specification.hpp"
#include "strategy/output/sink.hpp"

namespace slugs {

class JsonStrategy : public StrategySink {
public:
  JsonStrategy(const Specification &specification, std::ostream &out);
  void begin() override;
  void node(std::uint64_t id, std::uint32_t rank, const std::vector<bool> &state,
            const std::vector<std::uint64_t> &successors) override;
  void end() override;

private:
  const Specification &specification_;
  OutputBuffer out_;
  bool any_nodes_ = false;
};

} // namespace slugs
