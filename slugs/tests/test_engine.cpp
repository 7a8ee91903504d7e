// The engine from a specification to bytes: what it prints must not depend on
// the order of variables, and limits must end it cleanly.  Whether the bytes and
// verdicts are the right ones is for the corpus and the brute-force oracle.

#include "expect.hpp"
#include "game/fixpoint.hpp"
#include "game/solver.hpp"
#include "read/diagnostics.hpp"
#include "read/reader.hpp"
#include "strategy/sink.hpp"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <random>
#include <sstream>
#include <string>
#include <vector>

using namespace slugs;

namespace test_engine {
namespace {

Specification read(const std::string &text) {
  const Source source("test", text);
  Diagnostics diagnostics(source);
  Specification result = read_specification(source, diagnostics);
  EXPECT_EQ(diagnostics.error_count(), std::size_t{0});
  return result;
}

struct Result {
  Verdict verdict;
  std::string json;
};

Result solve(const Specification &specification, const SolverOptions &options, const Budget &budget = {}) {
  Solver solver(specification, options, budget);
  std::ostringstream out;
  JsonStrategy sink(specification, out);
  const Verdict verdict = solver.verdict();
  if (verdict == Verdict::Realizable)
    solver.strategy(sink);
  else
    solver.counterstrategy(sink);
  return {verdict, out.str()};
}

// Random formulas over the allowed variables, biased towards short ones.
class RandomGame {
public:
  explicit RandomGame(unsigned seed) : random_(seed) {}

  Specification make() {
    Specification s;
    s.file = "random";
    const unsigned inputs = 1 + random_() % 2, outputs = 1 + random_() % 3;
    // Declarations of both kinds mixed: the order of states is that of the file.
    for (unsigned i = 0; i < inputs + outputs; ++i)
      s.variables.push_back({"v" + std::to_string(i), Owner::Output, 1});
    std::vector<std::size_t> places(s.variables.size());
    std::iota(places.begin(), places.end(), std::size_t{0});
    std::shuffle(places.begin(), places.end(), random_);
    for (unsigned i = 0; i < inputs; ++i)
      s.variables[places[i]].owner = Owner::Input;
    add(s, Section::EnvInit, random_() % 2, true, false, false, false);
    add(s, Section::SysInit, random_() % 3, true, true, false, false);
    add(s, Section::EnvTrans, random_() % 3, true, true, true, false);
    add(s, Section::SysTrans, random_() % 3, true, true, true, true);
    add(s, Section::EnvLiveness, random_() % 3, true, true, true, true);
    add(s, Section::SysLiveness, random_() % 4, true, true, true, true);
    return s;
  }

private:
  void add(Specification &s, Section section, unsigned count, bool in, bool out, bool next_in,
           bool next_out) {
    std::vector<FormulaId> atoms;
    for (std::uint32_t v = 0; v < s.variables.size(); ++v) {
      const bool input = s.variables[v].owner == Owner::Input;
      if (input ? in : out)
        atoms.push_back(s.formulas.variable(v, false));
      if (input ? next_in : next_out)
        atoms.push_back(s.formulas.variable(v, true));
    }
    for (unsigned i = 0; i < count; ++i)
      s.add(section, tree(s.formulas, atoms, 3), 1, "", false);
  }

  FormulaId tree(FormulaPool &pool, const std::vector<FormulaId> &atoms, int depth) {
    if (depth == 0 || random_() % 4 == 0) {
      const FormulaId atom = atoms[random_() % atoms.size()];
      return random_() % 2 ? atom : pool.negation(atom);
    }
    const FormulaId f = tree(pool, atoms, depth - 1), g = tree(pool, atoms, depth - 1);
    switch (random_() % 4) {
    case 0:
      return pool.conjunction(f, g);
    case 1:
      return pool.exclusive_or(f, g);
    default:
      return pool.disjunction(f, g);
    }
  }

  std::mt19937 random_;
};

const char *const robot = R"([INPUT]
busy:0...5
[OUTPUT]
at:0...5
done
[ENV_INIT]
busy = 5
[SYS_INIT]
at = 0
!done
[ENV_TRANS]
busy' <= busy + 1
busy <= busy' + 1
[SYS_TRANS]
at' <= at + 1
at <= at' + 1
at' != busy'
[ENV_LIVENESS]
busy = 5
busy = 0
[SYS_LIVENESS]
at = 0 & done
at = 4 & !done'
)";

// The game solved as the definition says, without any technique of game/fixpoint.cpp:
//
//   nu Z. /\_j mu Y. \/_i nu X. cpre( (G_j & Z') | Y' | (!A_i & X') )
//   cpre(T) = forall x'. ENV_TRANS -> exists y'. SYS_TRANS & T
class PlainGame {
public:
  BddStore store;

  explicit PlainGame(const Specification &s, const std::vector<std::uint32_t> &order)
      : store(static_cast<std::uint32_t>(s.variables.size()), order, {}), specification_(s) {
    for (std::uint32_t v = 0; v < s.variables.size(); ++v)
      next_[s.variables[v].owner == Owner::Output].push_back(next_var(v));
    next_inputs_ = store.make_set(next_[0]);
    next_outputs_ = store.make_set(next_[1]);
  }

  Bdd winning() {
    const Bdd env = all(Section::EnvTrans), sys = all(Section::SysTrans);
    const auto cpre = [&](const Bdd &t) {
      return store.forall((!env) | store.exists(sys & t, next_outputs_), next_inputs_);
    };
    const auto iterate = [&](bool start, const auto &step) {
      Bdd last = store.constant(start);
      for (Bdd next = step(last); next != last; next = step(last))
        last = next;
      return last;
    };
    return iterate(true, [&](const Bdd &z) {
      Bdd result = store.constant(true);
      for (const Bdd &goal : each(Section::SysLiveness))
        result &= iterate(false, [&](const Bdd &y) {
          Bdd larger = store.constant(false);
          for (const Bdd &assumption : each(Section::EnvLiveness))
            larger |= iterate(true, [&](const Bdd &x) {
              return cpre((goal & store.to_next(z)) | store.to_next(y) | ((!assumption) & store.to_next(x)));
            });
          return larger;
        });
      return result;
    });
  }

private:
  std::vector<Bdd> each(Section section) {
    std::vector<Bdd> result;
    for (const Constraint &constraint : specification_[section])
      result.push_back(Translation(store, specification_.formulas)(constraint.formula));
    return result.empty() ? std::vector<Bdd>{store.constant(true)} : result;
  }
  Bdd all(Section section) {
    Bdd result = store.constant(true);
    for (const Bdd &part : each(section))
      result &= part;
    return result;
  }

  const Specification &specification_;
  std::vector<Var> next_[2];
  VarSet next_inputs_ = 0, next_outputs_ = 0;
};

// The fast fixpoint restricts the game to reachable states.  There it finds the same states if
// the system wins, and no smaller set if it loses.
void the_fixpoint_is_the_plain_one() {
  std::size_t won = 0, lost = 0;
  for (unsigned seed = 1000; seed < 1400; ++seed) {
    const Specification specification = RandomGame(seed).make();
    const Conjuncts conjuncts(specification, {});
    const Environment environment = independent_parts(specification, conjuncts, {});
    const std::vector<std::uint32_t> order =
        start_order(specification.variables.size(), conjuncts, environment.parts, {});
    PlainGame plain(specification, order);
    const FrozenBdd winning(plain.store, plain.winning());
    for (const Steps steps : {Steps::Plain, Steps::BiasForAction, Steps::Fewest}) {
      Game game(specification, order, {});
      game.build(conjuncts, environment);
      game.restrict_to(reachable_states(game));
      game.reordering.start_fixpoints();
      Fixpoint fixpoint(game, seed % 2, steps);
      const Bdd wanted = winning.thaw(game.store);
      const bool wins = fixpoint.solve();
      ++(wins ? won : lost);
      EXPECT_EQ(wins, game.wins_initially(wanted, seed % 2));
      EXPECT((wanted & game.states & !fixpoint.winning()).is_false());
      EXPECT(!wins || (fixpoint.winning() & !wanted).is_false());
    }
  }
  EXPECT(won > 300);
  EXPECT(lost > 300);
}

// Constants drawn from their ranges: diagrams are sifted, collected and split at any moment.
void bytes_do_not_depend_on_the_tuning() {
  std::mt19937_64 random(11);
  for (unsigned seed = 0; seed < 150; ++seed) {
    const Specification specification = RandomGame(seed).make();
    SolverOptions options;
    options.bias_for_action = seed % 3 == 0;
    options.robotics_init = seed % 5 == 0;
    const Result wanted = solve(specification, options);
    Budget budget;
    budget.tuning.each([&](std::size_t &value, std::size_t least, std::size_t most) {
      if (random() % 4 == 0)
        return;
      value = least;
      for (std::uint64_t k = random() % 12; k > 0 && 2 * value <= most; --k)
        value *= 2; // some have to be powers of two
    });
    const Result found = solve(specification, options, budget);
    EXPECT(found.verdict == wanted.verdict);
    EXPECT_EQ(found.json, wanted.json);
  }
}

void bytes_do_not_depend_on_the_order_of_variables() {
  std::mt19937 random(5);
  std::size_t realizable = 0, unrealizable = 0;
  const auto check = [&](const Specification &specification, int orders) {
    for (const bool robotics : {false, true})
      for (const bool bias : {false, true}) {
        SolverOptions options;
        options.robotics_init = robotics;
        options.bias_for_action = bias;
        const Result wanted = solve(specification, options);
        ++(wanted.verdict == Verdict::Realizable ? realizable : unrealizable);
        options.start_order.resize(specification.variables.size());
        std::iota(options.start_order.begin(), options.start_order.end(), 0u);
        for (int i = 0; i < orders; ++i) {
          std::shuffle(options.start_order.begin(), options.start_order.end(), random);
          const Result found = solve(specification, options);
          EXPECT(found.verdict == wanted.verdict);
          EXPECT_EQ(found.json, wanted.json);
        }
      }
  };
  for (unsigned seed = 0; seed < 200; ++seed)
    check(RandomGame(seed).make(), 2);
  EXPECT(realizable > 100);
  EXPECT(unrealizable > 100);
  check(read(robot), 4);
}

void a_bias_for_action_changes_choices_not_verdicts() {
  std::size_t different = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Specification specification = RandomGame(seed).make();
    SolverOptions biased;
    biased.bias_for_action = true;
    const Result plain = solve(specification, {}), other = solve(specification, biased);
    EXPECT(plain.verdict == other.verdict);
    different += plain.json != other.json;
  }
  EXPECT(different > 0);
}

void a_verdict_alone_is_the_same_verdict() {
  for (unsigned seed = 200; seed < 500; ++seed) {
    const Specification specification = RandomGame(seed).make();
    SolverOptions quick;
    quick.verdict_only = true;
    Solver solver(specification, quick, {});
    const Result full = solve(specification, {});
    EXPECT(solver.verdict() == full.verdict);
    std::ostringstream out;
    JsonStrategy sink(specification, out);
    if (full.verdict == Verdict::Unrealizable) {
      solver.counterstrategy(sink);
      EXPECT_EQ(out.str(), full.json);
      continue;
    }
    bool refused = false;
    try {
      solver.strategy(sink);
    } catch (const std::logic_error &) {
      refused = true;
    }
    EXPECT(refused);
  }
}

// Ehlers and Raman's example form: the text is the same automaton.
void both_forms_show_the_same_automaton() {
  const Specification s = read("[INPUT]\na\n[OUTPUT]\nb\n[SYS_INIT]\n! b\n[SYS_TRANS]\n! ^ b' a'\n");
  Solver solver(s, {}, {});
  std::ostringstream text, json;
  TextStrategy text_sink(s, text);
  JsonStrategy json_sink(s, json);
  solver.strategy(text_sink);
  solver.strategy(json_sink);
  EXPECT_EQ(text.str(), std::string("State 0 with rank 0 -> <a:0, b:0>\n\tWith successors : 0, 2\n"
                                    "State 1 with rank 0 -> <a:1, b:0>\n\tWith successors : 0, 2\n"
                                    "State 2 with rank 0 -> <a:1, b:1>\n\tWith successors : 0, 2\n"));
  EXPECT_EQ(json.str(),
            std::string("{\"version\": 0,\n \"slugs\": \"0.0.1\",\n\n \"variables\": [\"a\", \"b\"],\n\n"
                        " \"nodes\": {\n"
                        "\"0\": {\n\t\"rank\": 0,\n\t\"state\": [0, 0],\n\t\"trans\": [0, 2]\n},\n\n"
                        "\"1\": {\n\t\"rank\": 0,\n\t\"state\": [1, 0],\n\t\"trans\": [0, 2]\n},\n\n"
                        "\"2\": {\n\t\"rank\": 0,\n\t\"state\": [1, 1],\n\t\"trans\": [0, 2]\n}\n\n}}\n"));
}

// Sum-of-products over distant variables: large under every order.
Specification hard(unsigned bits) {
  Specification s;
  s.file = "hard";
  for (unsigned i = 0; i < bits; ++i)
    s.variables.push_back({"v" + std::to_string(i), i % 2 ? Owner::Output : Owner::Input, 1});
  std::mt19937 random(3);
  FormulaId all = s.formulas.constant(false);
  for (unsigned i = 0; i < 4 * bits; ++i) {
    FormulaId product = s.formulas.constant(true);
    for (int k = 0; k < 4; ++k)
      product = s.formulas.conjunction(product, s.formulas.variable(random() % bits, random() % 2));
    all = s.formulas.exclusive_or(all, product);
  }
  s.add(Section::SysTrans, all, 1, "", false);
  return s;
}

void limits_end_a_run_wherever_it_is() {
  const Specification specification = hard(40);
  for (const std::size_t megabytes : {1, 2, 3, 4, 5, 8}) {
    Budget budget;
    budget.memory_bytes = megabytes << 20;
    Solver solver(specification, {}, budget);
    bool limited = false;
    try {
      solver.verdict();
    } catch (const LimitReached &limit) {
      limited = limit.kind == LimitKind::Memory;
    }
    EXPECT(limited);
    EXPECT(!solver.progress().empty());
  }
  Budget late;
  late.deadline = Budget::Clock::now() + std::chrono::milliseconds(50);
  const auto start = Budget::Clock::now();
  Solver solver(specification, {}, late);
  bool limited = false;
  try {
    solver.verdict();
  } catch (const LimitReached &limit) {
    limited = limit.kind == LimitKind::Time;
  }
  EXPECT(limited);
  EXPECT(Budget::Clock::now() - start < std::chrono::seconds(10));
}

void a_run_can_start_again_after_an_interrupt() {
  const Specification specification = read(robot);
  const Result wanted = solve(specification, {});
  std::atomic<bool> interrupted{false};
  Budget budget;
  budget.interrupted = &interrupted;
  class Interrupting : public StrategySink {
  public:
    explicit Interrupting(std::atomic<bool> &flag) : flag_(flag) {}
    void begin() override { flag_ = true; }
    void node(std::uint64_t, std::uint32_t, const std::vector<bool> &,
              const std::vector<std::uint64_t> &) override {}
    void end() override {}

  private:
    std::atomic<bool> &flag_;
  };
  Solver solver(specification, {}, budget);
  const auto stops = [&](auto work) {
    try {
      work();
    } catch (const LimitReached &limit) {
      return limit.kind == LimitKind::Interrupt;
    }
    return false;
  };
  interrupted = true;
  EXPECT(stops([&] { solver.verdict(); }));
  interrupted = false;
  EXPECT(solver.verdict() == wanted.verdict);
  Interrupting interrupting(interrupted);
  EXPECT(stops([&] { solver.strategy(interrupting); }));
  interrupted = false;
  std::ostringstream out;
  JsonStrategy sink(specification, out);
  solver.strategy(sink);
  EXPECT_EQ(out.str(), wanted.json);
}

// 2^40 initial states and as many successors of each.
void strategies_larger_than_memory_reach_the_limit() {
  std::string text = "[INPUT]\n";
  for (int i = 0; i < 40; ++i)
    text += "i" + std::to_string(i) + "\n";
  text += "[OUTPUT]\no\n";
  for (const char *init : {"", "[SYS_INIT]\n! o\n[ENV_INIT]\n! i0\n"}) {
    std::string file = text + init;
    for (int i = 1; *init && i < 40; ++i)
      file += "! i" + std::to_string(i) + "\n";
    const Specification specification = read(file);
    Budget budget;
    budget.memory_bytes = 16 << 20;
    Solver solver(specification, {}, budget);
    EXPECT(solver.verdict() == Verdict::Realizable);
    std::ostringstream out;
    JsonStrategy sink(specification, out);
    bool limited = false;
    try {
      solver.strategy(sink);
    } catch (const LimitReached &limit) {
      limited = limit.kind == LimitKind::Memory;
    }
    EXPECT(limited);
  }
}

void two_solvers_live_side_by_side() {
  const Specification first = read(robot), second = RandomGame(4).make();
  const std::string wanted_first = solve(first, {}).json, wanted_second = solve(second, {}).json;
  Solver a(first, {}, {}), b(second, {}, {});
  b.verdict();
  a.verdict();
  std::ostringstream out_a, out_b;
  JsonStrategy sink_a(first, out_a), sink_b(second, out_b);
  a.verdict() == Verdict::Realizable ? a.strategy(sink_a) : a.counterstrategy(sink_a);
  b.verdict() == Verdict::Realizable ? b.strategy(sink_b) : b.counterstrategy(sink_b);
  EXPECT_EQ(out_a.str(), wanted_first);
  EXPECT_EQ(out_b.str(), wanted_second);
}

void a_specification_without_variables_has_one_state() {
  Specification empty;
  EXPECT(solve(empty, {}).verdict == Verdict::Realizable);
  empty.add(Section::SysTrans, empty.formulas.constant(false), 1, "", false);
  EXPECT(solve(empty, {}).verdict == Verdict::Unrealizable);
}

const expect::Suite suite("test_engine", [] {
  the_fixpoint_is_the_plain_one();
  bytes_do_not_depend_on_the_tuning();
  bytes_do_not_depend_on_the_order_of_variables();
  a_bias_for_action_changes_choices_not_verdicts();
  a_verdict_alone_is_the_same_verdict();
  both_forms_show_the_same_automaton();
  limits_end_a_run_wherever_it_is();
  a_run_can_start_again_after_an_interrupt();
  strategies_larger_than_memory_reach_the_limit();
  two_solvers_live_side_by_side();
  a_specification_without_variables_has_one_state();
});

} // namespace
} // namespace test_engine
