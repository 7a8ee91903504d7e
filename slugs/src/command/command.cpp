// What the command does, one function for each kind of run.
//
// Standard output holds the strategy, translation or result of a check and
// nothing else; all that is said to a person goes to standard error.

#include "command/command.hpp"

#include "certificate/check.hpp"
#include "certificate/json_reader.hpp"
#include "command/input_file.hpp"
#include "command/options.hpp"
#include "command/outfile.hpp"
#include "command/signals.hpp"
#include "core/version.hpp"
#include "game/solver.hpp"
#include "read/reader.hpp"
#include "read/translate.hpp"
#include "strategy/json_sink.hpp"
#include "strategy/text_sink.hpp"

#include <cmath>
#include <iostream>
#include <memory>
#include <new>
#include <optional>

namespace slugs {

namespace {

// Raised after all mistakes of the input have been printed.
struct InputRejected {};

Budget budget_of(const Options &options, const std::atomic<bool> &interrupted) {
  Budget budget;
  budget.interrupted = &interrupted;
  constexpr double longest = 1e9; // seconds; keeps the deadline representable
  if (options.timeout_seconds && *options.timeout_seconds < longest)
    budget.deadline = Budget::Clock::now() + std::chrono::duration_cast<Budget::Clock::duration>(
                                                 std::chrono::duration<double>(*options.timeout_seconds));
  if (options.memory_megabytes && *options.memory_megabytes < (static_cast<std::size_t>(-1) >> 20))
    budget.memory_bytes = *options.memory_megabytes << 20;
  return budget;
}

Specification read(const std::string &file) {
  const std::string text = read_file(file);
  const Source source(file, text);
  Diagnostics diagnostics(source);
  Specification specification = read_specification(source, diagnostics);
  diagnostics.print(std::cerr);
  if (diagnostics.error_count() > 0)
    throw InputRejected();
  return specification;
}

std::unique_ptr<StrategySink> sink_for(const Options &options, const Specification &specification,
                                       std::ostream &out) {
  if (options.json_output)
    return std::make_unique<JsonStrategy>(specification, out);
  return std::make_unique<TextStrategy>(specification, out);
}

// Statistics are kept whatever way the run ends.
class StatsFile {
public:
  explicit StatsFile(const std::optional<std::string> &path) {
    if (path && *path == "-")
      to_standard_error_ = true;
    else if (path)
      file_.emplace(*path);
  }
  void write(const Solver &solver, const char *verdict) {
    if (to_standard_error_)
      std::cerr << to_json(solver.statistics(), verdict);
    if (!file_)
      return;
    file_->stream() << to_json(solver.statistics(), verdict);
    file_->commit();
  }

private:
  bool to_standard_error_ = false;
  std::optional<OutFile> file_;
};

ExitStatus solve(const Options &options, const Budget &budget) {
  std::cerr << "slugs " << version << ": synthesis from GR(1) specifications\n";
  const Specification specification = read(options.file);
  // Opened first: an output that cannot be written should not cost a solution.
  StatsFile stats(options.stats_file);
  std::optional<OutFile> out;
  if (options.explicit_strategy || options.counter_strategy)
    out.emplace(options.outfile);

  SolverOptions solver_options;
  solver_options.robotics_init = options.robotics_init;
  solver_options.bias_for_action = options.bias_for_action;
  solver_options.verdict_only = !options.explicit_strategy;
  Solver solver(specification, solver_options, budget);
  const char *word = "unknown";
  try {
    const bool realizable = solver.verdict() == Verdict::Realizable;
    word = realizable ? "realizable" : "unrealizable";
    std::cerr << "RESULT: Specification is " << word << ".\n";
    if (realizable ? options.explicit_strategy : options.counter_strategy) {
      const std::unique_ptr<StrategySink> sink = sink_for(options, specification, out->stream());
      if (realizable)
        solver.strategy(*sink);
      else
        solver.counterstrategy(*sink);
      out->commit();
    }
    stats.write(solver, word);
    return realizable ? ExitStatus::Realizable : ExitStatus::Unrealizable;
  } catch (const LimitReached &limit) {
    std::cerr << "slugs: " << limit.what() << ' ' << solver.progress() << '\n';
  } catch (const std::bad_alloc &) {
    std::cerr << "slugs: out of memory " << solver.progress() << '\n';
  }
  stats.write(solver, word);
  return ExitStatus::Limit;
}

ExitStatus print_translation(const Options &options) {
  const Specification specification = read(options.file);
  OutFile out(options.outfile);
  translate(specification, out.stream());
  out.commit();
  return ExitStatus::Realizable;
}

ExitStatus check_certificate(const Options &options, const Budget &budget) {
  const Specification specification = read(options.file);
  const ExplicitStrategy strategy = read_strategy(*options.check, read_file(*options.check));
  const bool counter = options.counter_strategy;
  const CheckResult result =
      check(specification, strategy, counter ? CertificateKind::Counterstrategy : CertificateKind::Strategy,
            options.robotics_init, budget);
  OutFile out("");
  out.stream() << (counter ? "counterstrategy " : "strategy ");
  if (result.accepted)
    out.stream() << "accepted: " << strategy.size() << " nodes, " << strategy.successors.size() << " edges\n";
  else
    out.stream() << "rejected: " << result.reason << '\n';
  out.commit();
  return result.accepted ? ExitStatus::Realizable : ExitStatus::Rejected;
}

ExitStatus dispatch(const std::vector<std::string> &arguments, const std::atomic<bool> &interrupted) {
  const Options options = parse_options(arguments);
  if (options.help || options.version) {
    OutFile out("");
    if (options.help)
      print_help(out.stream());
    else
      out.stream() << "slugs " << version << '\n';
    out.commit();
    return ExitStatus::Realizable;
  }
  const Budget budget = budget_of(options, interrupted);
  if (options.translate)
    return print_translation(options);
  if (options.check)
    return check_certificate(options, budget);
  return solve(options, budget);
}

} // namespace

ExitStatus run_command(const std::vector<std::string> &arguments) {
  const std::atomic<bool> &interrupted = catch_signals();
  const auto fail = [&](ExitStatus status, const std::string &message) {
    std::cerr << "slugs: " << message << '\n';
    return status;
  };
  try {
    return dispatch(arguments, interrupted);
  } catch (const InputRejected &) {
    return ExitStatus::BadInput;
  } catch (const UsageError &error) {
    fail(ExitStatus::BadInput, error.what());
    std::cerr << (error.hint.empty() ? "" : "  hint: " + error.hint + "\n")
              << "  usage: slugs [options] FILE [OUTFILE]\n";
    return ExitStatus::BadInput;
  } catch (const LimitReached &limit) {
    return fail(ExitStatus::Limit, limit.what());
  } catch (const std::bad_alloc &) {
    return fail(ExitStatus::Limit, "out of memory");
  } catch (const std::exception &error) {
    // A read or write that a signal cut short is an interrupt, not a failure.
    if (interrupted.load())
      return fail(ExitStatus::Limit, "interrupted");
    if (dynamic_cast<const JsonError *>(&error)) {
      std::cerr << error.what() << '\n';
      return ExitStatus::BadInput;
    }
    if (dynamic_cast<const FileError *>(&error) || dynamic_cast<const OpenError *>(&error))
      return fail(ExitStatus::BadInput, error.what());
    if (dynamic_cast<const WriteError *>(&error))
      return fail(ExitStatus::Internal, error.what());
    return fail(ExitStatus::Internal, std::string("internal error, please report it: ") + error.what());
  }
}

} // namespace slugs
