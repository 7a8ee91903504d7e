// Output of an explicit strategy as text, in the format of SLUGS without --jsonOutput.

#pragma once

#include "core/output_buffer.hpp"
#include "core/specification.hpp"
#include "strategy/output/sink.hpp"

#include <string>

namespace slugs {

class TextStrategy : public StrategySink {
public:
  TextStrategy(const Specification &specification, std::ostream &out);
  void begin() override;
  void node(std::uint64_t id, std::uint32_t rank, const std::vector<bool> &state,
            const std::vector<std::uint64_t> &successors) override;
  void end() override;

private:
  std::vector<std::string> names_; // in the order of output, each with its colon
  OutputBuffer out_;
};

} // namespace slugs
