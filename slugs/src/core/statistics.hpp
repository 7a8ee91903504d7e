// Statistics of a run, updated by the engine as it proceeds, so that they are also
// correct for a run that a limit ended.

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
  std::uint64_t variables = 0; // bits, without their next-state copies
  std::uint64_t inputs = 0;
  std::uint64_t outputs = 0;
  std::array<std::uint64_t, section_count> constraints{}; // indexed by Section

  double reachable_states = 0; // 0 until known

  std::uint64_t safety_iterations = 0;     // iterations of the fixpoint without liveness
  std::uint64_t outer_iterations = 0;      // iterations of Z
  std::vector<std::uint64_t> y_iterations; // per goal
  std::vector<std::uint64_t> x_iterations; // per goal

  std::uint64_t peak_nodes = 0; // maximum allocated simultaneously, including dead nodes
  std::uint64_t live_nodes = 0; // nodes after the last collection
  // Measures of work that do not depend on the machine's load: operation steps that
  // missed the operation cache, and nodes visited by reordering.
  std::uint64_t operation_steps = 0;
  std::uint64_t reordering_steps = 0;
  std::uint64_t reorderings = 0;
  std::uint64_t collections = 0;
  std::uint64_t memory_bytes = 0; // peak size of the engine's tables

  std::uint64_t strategy_nodes = 0; // nodes written so far
  std::uint64_t strategy_edges = 0;

  std::array<double, phase_count> seconds{}; // wall time, indexed by Phase

  // Whether the specification is realizable and the environment can deadlock: it has
  // no initial valuation, or some reachable winning state allows no next input.
  bool vacuous_win = false;
};

// Return a JSON object, one line per field, with a final newline.  `verdict` is a
// word such as "realizable" or "unknown".
std::string to_json(const Statistics &statistics, const std::string &verdict);

} // namespace slugs
