// The face of the engine: one specification in, a verdict and certificates out.
//
// No global state: two solvers can live in one process.  Everything throws
// LimitReached when the budget is exhausted; what has been sent to a sink by then
// is incomplete and must be discarded by the caller.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"
#include "core/statistics.hpp"
#include "strategy/output/sink.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace slugs {

class OnDemandStrategy;

enum class Verdict { Realizable, Unrealizable };

struct SolverOptions {
  bool robotics_init = false;   // --sysInitRoboticsSemantics
  bool bias_for_action = false; // --biasForAction
  // Only the verdict is wanted, perhaps a counterstrategy: strategy() must not
  // be called.  Faster, because the fixpoint need not follow the order of steps
  // that fixes a strategy.
  bool verdict_only = false;
  // Of a listed strategy; one that has more is a LimitReached.
  std::size_t most_nodes = static_cast<std::size_t>(-1);
  // Variables from the top, as indices into Specification::variables; empty:
  // the solver chooses.  Changes speed and nothing else; for tests.
  std::vector<std::uint32_t> start_order;
};

class Solver {
public:
  Solver(const Specification &specification, const SolverOptions &options, const Budget &budget);
  ~Solver();
  Solver(const Solver &) = delete;
  Solver &operator=(const Solver &) = delete;

  Verdict verdict();                        // solves at the first call
  void strategy(StrategySink &sink);        // only if realizable and not verdict_only
  void counterstrategy(StrategySink &sink); // only if unrealizable
  // The same strategy move by move, only if realizable and not verdict_only;
  // lives as long as the solver, which then does nothing else.  The time limit
  // has no further effect.
  OnDemandStrategy &on_demand();
  const Statistics &statistics() const; // valid at any time, also after LimitReached
  std::string progress() const;         // one line: how far it got

private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

} // namespace slugs
