// Phases of the engine: variable order, game, reachable states, fixpoint, and on
// request a strategy or a counterstrategy.

#include "game/solver.hpp"

#include "game/analysis.hpp"
#include "game/fixpoint.hpp"
#include "game/game.hpp"
#include "strategy/extraction.hpp"

#include <cassert>
#include <exception>
#include <functional>
#include <new>
#include <optional>

#include <pthread.h>
#include <sys/resource.h>

namespace slugs {

namespace {

// Run `work` where the stack has at least this many bytes: on the present one, or on a
// thread's own.
void run_with_stack(std::size_t bytes, const Budget &budget, const std::function<void()> &work) {
  constexpr std::size_t used = 1u << 18; // by main(), the environment and the arguments
  rlimit limit;
  if (::getrlimit(RLIMIT_STACK, &limit) == 0 &&
      (limit.rlim_cur == RLIM_INFINITY || limit.rlim_cur > bytes + used))
    return work();
  if (bytes > budget.memory_bytes)
    MemoryAccount::refuse();
  struct Task {
    const std::function<void()> &work;
    std::exception_ptr failure;
  } task{work, nullptr};
  const auto run = [](void *argument) -> void * {
    Task &task = *static_cast<Task *>(argument);
    try {
      task.work();
    } catch (...) {
      task.failure = std::current_exception();
    }
    return nullptr;
  };
  assert(bytes > 0);
  pthread_t thread;
  pthread_attr_t attributes;
  ::pthread_attr_init(&attributes);
  const bool started = ::pthread_attr_setstacksize(&attributes, bytes + used) == 0 &&
                       ::pthread_create(&thread, &attributes, run, &task) == 0;
  ::pthread_attr_destroy(&attributes);
  if (!started)
    MemoryAccount::refuse();
  ::pthread_join(thread, nullptr);
  if (task.failure)
    std::rethrow_exception(task.failure);
}

} // namespace

struct Solver::Implementation {
  enum class Phase { Build, Reach, Solve, Strategy };

  const Specification &specification;
  SolverOptions options;
  Budget budget;
  Phase phase = Phase::Build;
  std::uint64_t written = 0; // nodes
  std::optional<Game> game;
  std::optional<Fixpoint> fixpoint;
  std::optional<Verdict> verdict;

  Implementation(const Specification &s, const SolverOptions &o, const Budget &b)
      : specification(s), options(o), budget(b) {}

  template <typename Work> void run(Phase which, Work work) {
    assert(phase <= which); // phases follow one another
    phase = which;
    budget.check();
    try {
      run_with_stack(stack_bytes(), budget, work);
    } catch (const std::bad_alloc &) {
      MemoryAccount::refuse();
    }
  }

  // Recursions descend by a level or a variable with each call.  Their depth is at most
  // both copies of the variables, and one more for an operation within a traversal.
  std::size_t stack_bytes() const { return 3 * specification.variables.size() * budget.tuning.level_stack; }

  void solve();
};

void Solver::Implementation::solve() {
  // A limit may have ended an earlier attempt.  Handles are destroyed before their store.
  fixpoint.reset();
  game.reset();
  phase = Phase::Build;
  assert(!verdict);
  run(Phase::Build, [&] {
    const Conjuncts conjuncts(specification, budget);
    const Environment environment = independent_parts(specification, conjuncts, budget);
    const std::vector<std::uint32_t> order =
        options.start_order.empty()
            ? start_order(specification.variables.size(), conjuncts, environment.parts, budget)
            : options.start_order;
    assert(order.size() == specification.variables.size());
    game.emplace(specification, order, budget);
    game->build(conjuncts, environment);
  });
  run(Phase::Reach, [&] {
    const Bdd reachable = reachable_states(*game);
    game->restrict_to(reachable);
    assert(game->states == reachable);
    game->reordering.start_fixpoints();
  });
  run(Phase::Solve, [&] {
    const Steps steps = options.verdict_only      ? Steps::Fewest
                        : options.bias_for_action ? Steps::BiasForAction
                                                  : Steps::Plain;
    fixpoint.emplace(*game, options.robotics_init, steps);
    verdict = fixpoint->solve() ? Verdict::Realizable : Verdict::Unrealizable;
    assert(game->store.implies(fixpoint->winning(), game->states));
    assert(game->wins_initially(fixpoint->winning(), options.robotics_init) ==
           (verdict == Verdict::Realizable));
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
  it.written = 0;
  it.run(Implementation::Phase::Strategy,
         [&] { extract_strategy(*it.game, *it.fixpoint, it.options.most_nodes, sink, it.written); });
}

void Solver::counterstrategy(StrategySink &sink) {
  Implementation &it = *implementation_;
  if (verdict() != Verdict::Unrealizable)
    throw std::logic_error("a counterstrategy of a realizable specification");
  it.written = 0;
  it.run(Implementation::Phase::Strategy, [&] {
    it.game->join_parts();
    const Bdd losing = it.game->states & !it.fixpoint->winning();
    extract_counterstrategy(*it.game, losing, it.options.robotics_init, sink, it.written);
  });
}

std::string Solver::progress() const {
  const Implementation &it = *implementation_;
  const auto count = [](std::uint64_t n, const std::string &what) {
    return std::to_string(n) + ' ' + what + (n == 1 ? "" : "s");
  };
  using Phase = Implementation::Phase;
  switch (it.phase) {
  case Phase::Build:
    return "while building the game";
  case Phase::Reach:
    return "while computing the reachable states";
  case Phase::Solve:
    return "while solving, in " + count(it.fixpoint ? it.fixpoint->outer_iterations() : 0, "outer iteration");
  case Phase::Strategy:
    return "while writing the strategy, after " + count(it.written, "node");
  }
  return "";
}

} // namespace slugs
