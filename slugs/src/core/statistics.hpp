// What a run did, in numbers: filled in by the engine as it goes, so that it is
// also true for a run that a limit cut short.

#pragma once

#include "core/specification.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace slugs {

enum class Phase : std::uint8_t { Build, Reach, Solve, Strategy };
inline constexpr std::size_t phase_count = 4;
inline constexpr std::array<const char *, phase_count> phase_names = {"build", "reach", "solve", "strategy"};

struct Statistics {
  std::uint64_t variables = 0; // bits, without their next copies
  std::uint64_t inputs = 0;
  std::uint64_t outputs = 0;
  std::array<std::uint64_t, section_count> constraints{}; // indexed by Section

  double reachable_states = 0; // 0 until known

  std::uint64_t safety_iterations = 0;     // of the fixpoint without liveness
  std::uint64_t outer_iterations = 0;      // of Z
  std::vector<std::uint64_t> y_iterations; // for each goal
  std::vector<std::uint64_t> x_iterations; // for each goal

  std::uint64_t peak_nodes = 0; // allocated at one time, dead ones included
  std::uint64_t live_nodes = 0; // after the last collection
  // Labour that does not depend on how busy the machine is: steps of operations
  // that their cache did not know, and nodes visited by reordering.
  std::uint64_t operation_steps = 0;
  std::uint64_t reordering_steps = 0;
  std::uint64_t reorderings = 0;
  std::uint64_t collections = 0;
  std::uint64_t memory_bytes = 0; // peak of the engine's tables

  std::uint64_t strategy_nodes = 0; // handed out so far
  std::uint64_t strategy_edges = 0;

  std::array<double, phase_count> seconds{}; // wall time, indexed by Phase

  // Realizable, but only or also because the environment can get stuck: it has
  // no initial valuation, or some reachable winning state allows no next input.
  bool vacuous_win = false;
};

// A JSON object, one line a field, newline at the end.  `verdict` is a word
// such as "realizable" or "unknown".
std::string to_json(const Statistics &statistics, const std::string &verdict);

} // namespace slugs
