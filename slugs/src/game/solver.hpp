// Interface of the engine: computes the verdict and certificates of a specification.
//
// There is no global state: solvers are independent.  All functions throw
// LimitReached when the budget is exhausted; the output of a sink is then
// incomplete, and the caller must discard it.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"
#include "strategy/sink.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace slugs {

enum class Verdict { Realizable, Unrealizable };

struct SolverOptions {
  bool robotics_init = false;   // --sysInitRoboticsSemantics
  bool bias_for_action = false; // --biasForAction
  // Compute only the verdict and perhaps a counterstrategy; strategy() must not be
  // called.  This is faster, since the order of steps in the fixpoint, which determines
  // the strategy, is then free.
  bool verdict_only = false;
  // Node limit of an explicit strategy; a larger one throws LimitReached.
  std::size_t most_nodes = static_cast<std::size_t>(-1);
  // Initial variable order from the top, as indices into Specification::variables;
  // empty: the solver chooses.  It affects speed only; for tests.
  std::vector<std::uint32_t> start_order;
};

class Solver {
public:
  Solver(const Specification &specification, const SolverOptions &options, const Budget &budget);
  ~Solver();
  Solver(const Solver &) = delete;
  Solver &operator=(const Solver &) = delete;

  Verdict verdict();                        // solves the game on the first call
  void strategy(StrategySink &sink);        // only if realizable and not verdict_only
  void counterstrategy(StrategySink &sink); // only if unrealizable
  std::string progress() const;             // one line, even after LimitReached

private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

} // namespace slugs
