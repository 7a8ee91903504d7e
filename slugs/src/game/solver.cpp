// Phases of the engine: variable order, game, reachable states, fixpoint, and on
// request a strategy or a counterstrategy.

#include "game/solver.hpp"

#include "game/analysis/order.hpp"
#include "game/fixpoint.hpp"
#include "game/game.hpp"
#include "game/reach.hpp"
#include "strategy/counter_extraction.hpp"
#include "strategy/extraction.hpp"
#include "strategy/on_demand.hpp"

#include <algorithm>
#include <new>
#include <optional>

namespace slugs {

struct Solver::Implementation {
  const Specification &specification;
  SolverOptions options;
  Budget budget;
  Statistics statistics{};
  Phase phase = Phase::Build;
  std::optional<Game> game;
  std::optional<Fixpoint> fixpoint;
  std::optional<OnDemandStrategy> on_demand;
  std::optional<Verdict> verdict;

  Implementation(const Specification &s, const SolverOptions &o, const Budget &b)
      : specification(s), options(o), budget(b) {
    statistics.variables = s.variables.size();
    for (const Variable &v : s.variables)
      ++(v.owner == Owner::Input ? statistics.inputs : statistics.outputs);
    for (std::size_t i = 0; i < section_count; ++i)
      statistics.constraints[i] = s.constraints[i].size();
  }

  // Run a phase and update the statistics, even if a limit ends it.
  template <typename Work> void timed(Phase which, Work work) {
    phase = which;
    const auto start = Budget::Clock::now();
    const auto account = [&] {
      statistics.seconds[static_cast<std::size_t>(which)] +=
          std::chrono::duration<double>(Budget::Clock::now() - start).count();
      observe();
    };
    try {
      budget.check();
      work();
    } catch (const std::bad_alloc &) {
      account();
      MemoryAccount::refuse();
    } catch (...) {
      account();
      throw;
    }
    account();
  }

  void observe() {
    if (!game)
      return;
    statistics.live_nodes = game->store.live_nodes();
    statistics.peak_nodes = game->store.peak_nodes();
    statistics.operation_steps = game->store.work();
    statistics.reordering_steps = game->store.sifting_work();
    statistics.reorderings = game->store.reorderings();
    statistics.collections = game->store.collections();
    statistics.memory_bytes = game->store.account().peak();
  }

  void solve();
};

void Solver::Implementation::solve() {
  // A limit may have ended an earlier attempt.  Handles are destroyed before their store.
  on_demand.reset();
  fixpoint.reset();
  game.reset();
  timed(Phase::Build, [&] {
    const Conjuncts conjuncts(specification, budget);
    const Environment environment = independent_parts(specification, conjuncts, budget);
    const std::vector<std::uint32_t> order =
        options.start_order.empty()
            ? start_order(specification.variables.size(), conjuncts, environment.parts, budget)
            : options.start_order;
    game.emplace(specification, order, budget);
    game->build(conjuncts, environment);
  });
  timed(Phase::Reach, [&] {
    const Bdd reachable = reachable_states(*game);
    statistics.reachable_states =
        game->store.count(exactly_reachable(*game, reachable), game->current_vars());
    game->restrict_to(reachable);
    game->reordering.start_fixpoints();
  });
  timed(Phase::Solve, [&] {
    const Steps steps = options.verdict_only      ? Steps::Fewest
                        : options.bias_for_action ? Steps::BiasForAction
                                                  : Steps::Plain;
    fixpoint.emplace(*game, options.robotics_init, steps, statistics);
    verdict = fixpoint->solve() ? Verdict::Realizable : Verdict::Unrealizable;
    if (verdict == Verdict::Realizable) {
      const Bdd stuck = fixpoint->winning() & !game->sources(game->moves_from(fixpoint->winning()));
      statistics.vacuous_win = game->env_init.is_false() || !stuck.is_false();
    }
  });
}

Solver::Solver(const Specification &specification, const SolverOptions &options, const Budget &budget)
    : implementation_(std::make_unique<Implementation>(specification, options, budget)) {}

Solver::~Solver() = default;

Verdict Solver::verdict() {
  Implementation &it = *implementation_;
  if (!it.verdict)
    it.solve();
  return *it.verdict;
}

void Solver::strategy(StrategySink &sink) {
  Implementation &it = *implementation_;
  if (verdict() != Verdict::Realizable)
    throw std::logic_error("a strategy of an unrealizable specification");
  if (it.options.verdict_only)
    throw std::logic_error("a strategy after solving for the verdict only");
  it.timed(Phase::Strategy,
           [&] { extract_strategy(*it.game, *it.fixpoint, it.options.most_nodes, sink, it.statistics); });
}

OnDemandStrategy &Solver::on_demand() {
  Implementation &it = *implementation_;
  if (verdict() != Verdict::Realizable)
    throw std::logic_error("a strategy of an unrealizable specification");
  if (it.options.verdict_only)
    throw std::logic_error("a strategy after solving for the verdict only");
  it.timed(Phase::Strategy, [&] {
    it.on_demand.emplace(*it.game, *it.fixpoint);
    it.game->store.account().remove_deadline();
  });
  return *it.on_demand;
}

void Solver::counterstrategy(StrategySink &sink) {
  Implementation &it = *implementation_;
  if (verdict() != Verdict::Unrealizable)
    throw std::logic_error("a counterstrategy of a realizable specification");
  it.timed(Phase::Strategy, [&] {
    it.game->join_parts();
    const Bdd losing = it.game->states & !it.fixpoint->winning();
    extract_counterstrategy(*it.game, losing, it.options.robotics_init, sink, it.statistics);
  });
}

const Statistics &Solver::statistics() const { return implementation_->statistics; }

std::string Solver::progress() const {
  const Statistics &s = implementation_->statistics;
  const auto count = [](std::uint64_t n, const std::string &what) {
    return std::to_string(n) + ' ' + what + (n == 1 ? "" : "s");
  };
  switch (implementation_->phase) {
  case Phase::Build:
    return "while building the game";
  case Phase::Reach:
    return "while computing the reachable states";
  case Phase::Solve:
    return "while solving, in " + count(s.outer_iterations, "outer iteration");
  case Phase::Strategy:
    return "while writing the strategy, after " + count(s.strategy_nodes, "node");
  }
  return "";
}

} // namespace slugs
