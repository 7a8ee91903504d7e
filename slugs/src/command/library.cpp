// The public interface, include/slugs.hpp, over readers, solver and checker.

#include "slugs.hpp"

#include "certificate/check.hpp"
#include "certificate/graph/json_reader.hpp"
#include "core/version.hpp"
#include "game/solver.hpp"
#include "read/reader.hpp"
#include "read/slugsin/translate.hpp"
#include "strategy/output/json_sink.hpp"

#include <sstream>
#include <utility>

namespace slugs {

struct Synthesis::Implementation {
  Settings settings;
  Budget budget;
  std::string warnings;
  Specification specification;
  std::unique_ptr<Solver> solver;
  const char *verdict = "unknown"; // so far

  // Runs `work`, and turns the engine's limits into the library's.
  template <class Work> auto stoppable(Work work) const {
    try {
      return work();
    } catch (const LimitReached &limit) {
      throw Stopped(limit.what() + (" " + solver->progress()));
    }
  }

  bool realizable() {
    return stoppable([&] {
      const bool result = solver->verdict() == Verdict::Realizable;
      verdict = result ? "realizable" : "unrealizable";
      return result;
    });
  }

  void write(std::ostream &out, Verdict wanted) {
    if (realizable() != (wanted == Verdict::Realizable))
      throw std::logic_error(wanted == Verdict::Realizable
                                 ? "the specification is unrealizable: there is no strategy"
                                 : "the specification is realizable: there is no counterstrategy");
    stoppable([&] {
      JsonStrategy sink(specification, out);
      if (wanted == Verdict::Realizable)
        solver->strategy(sink);
      else
        solver->counterstrategy(sink);
    });
  }

  Check check(const std::string &json, CertificateKind kind) const {
    try {
      const ExplicitStrategy strategy = read_strategy("strategy", json);
      const CheckResult result = slugs::check(specification, strategy, kind, settings.robotics_init, budget);
      return {result.accepted, result.reason};
    } catch (const JsonError &error) {
      throw std::invalid_argument(error.what());
    } catch (const LimitReached &limit) {
      throw Stopped(std::string(limit.what()) + " while checking");
    }
  }
};

Synthesis::Synthesis(std::string text) : Synthesis(std::move(text), Settings()) {}

Synthesis::Synthesis(std::string text, const Settings &settings, std::string name)
    : implementation_(std::make_unique<Implementation>()) {
  Implementation &it = *implementation_;
  it.settings = settings;
  constexpr double longest = 1e9; // seconds; keeps the deadline representable
  if (settings.time.count() < longest)
    it.budget.deadline =
        Budget::Clock::now() + std::chrono::duration_cast<Budget::Clock::duration>(settings.time);
  it.budget.memory_bytes = settings.memory_bytes;
  it.budget.interrupted = settings.interrupted;

  const Source source(std::move(name), text);
  Diagnostics diagnostics(source);
  it.specification = read_specification(source, diagnostics);
  std::ostringstream messages;
  diagnostics.print(messages);
  if (diagnostics.error_count() > 0)
    throw InvalidSpecification(messages.str());
  it.warnings = messages.str();

  SolverOptions options;
  options.robotics_init = settings.robotics_init;
  options.bias_for_action = settings.bias_for_action;
  it.solver = std::make_unique<Solver>(it.specification, options, it.budget);
}

Synthesis::~Synthesis() = default;
Synthesis::Synthesis(Synthesis &&) noexcept = default;
Synthesis &Synthesis::operator=(Synthesis &&) noexcept = default;

std::string Synthesis::warnings() const { return implementation_->warnings; }

bool Synthesis::realizable() { return implementation_->realizable(); }

void Synthesis::strategy(std::ostream &out) { implementation_->write(out, Verdict::Realizable); }
void Synthesis::counterstrategy(std::ostream &out) { implementation_->write(out, Verdict::Unrealizable); }

std::string Synthesis::strategy() {
  std::ostringstream out;
  strategy(out);
  return out.str();
}

std::string Synthesis::counterstrategy() {
  std::ostringstream out;
  counterstrategy(out);
  return out.str();
}

Synthesis::Check Synthesis::check_strategy(const std::string &json) const {
  return implementation_->check(json, CertificateKind::Strategy);
}

Synthesis::Check Synthesis::check_counterstrategy(const std::string &json) const {
  return implementation_->check(json, CertificateKind::Counterstrategy);
}

std::string Synthesis::slugsin() const {
  std::ostringstream out;
  translate(implementation_->specification, out);
  return out.str();
}

std::string Synthesis::statistics() const {
  return to_json(implementation_->solver->statistics(), implementation_->verdict);
}

const char *Synthesis::version() { return slugs::version; }

} // namespace slugs
