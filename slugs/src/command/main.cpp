// The command `slugs`: one function for each kind of run.
//
// Standard output holds the strategy or translation and nothing else; all messages go to
// standard error.

#include "command/files.hpp"
#include "command/options.hpp"
#include "game/solver.hpp"
#include "read/reader.hpp"
#include "read/slugsin.hpp"
#include "strategy/sink.hpp"

#include <atomic>
#include <cassert>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <new>
#include <optional>
#include <string>

#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#ifdef __linux__
#include <sys/prctl.h>
#endif

namespace slugs {

namespace {

// SIGINT, SIGTERM and SIGHUP as a flag that a Budget can watch.
std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may not lock");

extern "C" void note_interrupt(int) { interrupted.store(true, std::memory_order_relaxed); }

// Install the handlers: these signals only set the flag, and a write to a closed pipe
// fails instead of ending the process.
void catch_signals() {
  // No SA_RESTART: a read or write that blocks must end as well.
  struct sigaction action = {};
  action.sa_handler = note_interrupt;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGHUP, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
}

// If a standard descriptor is closed, the next file opened would get its number,
// and thus the messages.  So closed ones are opened in the wrong direction: their
// uses still fail.
void reserve_standard_descriptors() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(descriptor, F_GETFD) < 0)
      ::open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

// The program must end with the process SLUGS_PARENT.  The kernel kills it when
// the thread that started it ends; the process may have ended before.
void die_with_parent() {
#ifdef __linux__
  const char *parent = std::getenv("SLUGS_PARENT");
  if (!parent)
    return;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (std::to_string(::getppid()) != parent)
    ::raise(SIGKILL);
#endif
}

// Thrown after all errors of the input have been printed.
struct InputRejected : Error {
  InputRejected() : Error(ExitStatus::BadInput, "the input has mistakes") {}
  std::string message() const override { return ""; }
};

// Return half the memory that this process may use: the machine's, or a lower limit.
std::size_t default_memory() {
  std::size_t bytes = static_cast<std::size_t>(-1);
  const long pages = ::sysconf(_SC_PHYS_PAGES), size = ::sysconf(_SC_PAGESIZE);
  if (pages > 0 && size > 0)
    bytes = static_cast<std::size_t>(pages) * static_cast<std::size_t>(size);
  rlimit limit;
  if (::getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur < bytes)
    bytes = static_cast<std::size_t>(limit.rlim_cur);
  assert(bytes > 1);
  return bytes / 2;
}

Budget budget_of(const Options &options) {
  Budget budget;
  budget.interrupted = &interrupted;
  constexpr double longest = 1e9; // seconds; keeps the deadline representable
  if (options.timeout_seconds && *options.timeout_seconds < longest)
    budget.deadline = Budget::Clock::now() + std::chrono::duration_cast<Budget::Clock::duration>(
                                                 std::chrono::duration<double>(*options.timeout_seconds));
  if (!options.memory_megabytes)
    budget.memory_bytes = default_memory();
  else if (*options.memory_megabytes < (static_cast<std::size_t>(-1) >> 20))
    budget.memory_bytes = *options.memory_megabytes << 20;
  return budget;
}

Specification read(const std::string &file, const Budget &budget) try {
  assert(!file.empty());
  const std::string text = read_file(file, budget);
  const Source source(file, text);
  Diagnostics diagnostics(source);
  Specification specification = read_specification(source, diagnostics, budget);
  diagnostics.print(std::cerr);
  if (diagnostics.error_count() > 0)
    throw InputRejected();
  return specification;
} catch (const LimitReached &limit) {
  throw LimitReached(limit.kind, limit.what() + std::string(" while reading the specification"));
} catch (const std::bad_alloc &) {
  throw LimitReached(LimitKind::Memory, "memory limit reached while reading the specification");
}

// A verdict that cannot be written is not a verdict.
void report(const std::string &text) {
  std::cerr << text;
  if (!std::cerr)
    throw WriteError("cannot write to standard error");
}

std::unique_ptr<StrategySink> sink_for(const Options &options, const Specification &specification,
                                       std::ostream &out) {
  if (options.json_output)
    return std::make_unique<JsonStrategy>(specification, out);
  return std::make_unique<TextStrategy>(specification, out);
}

ExitStatus solve(const Options &options, const Budget &budget) {
  report("slugs " + std::string(version) + ": synthesis from GR(1) specifications\n");
  const Specification specification = read(options.file, budget);
  // Opened first, so that an unwritable file fails before the game is solved.
  std::optional<OutFile> out;
  if (options.explicit_strategy || options.counter_strategy)
    out.emplace(options.outfile);

  SolverOptions solver_options;
  solver_options.robotics_init = options.robotics_init;
  solver_options.bias_for_action = options.bias_for_action;
  solver_options.verdict_only = !options.explicit_strategy;
  if (options.most_nodes)
    solver_options.most_nodes = *options.most_nodes;
  Solver solver(specification, solver_options, budget);
  try {
    const bool realizable = solver.verdict() == Verdict::Realizable;
    report(std::string("RESULT: Specification is ") + (realizable ? "realizable" : "unrealizable") + ".\n");
    if (realizable ? options.explicit_strategy : options.counter_strategy) {
      assert(out);
      const std::unique_ptr<StrategySink> sink = sink_for(options, specification, out->stream());
      if (realizable)
        solver.strategy(*sink);
      else
        solver.counterstrategy(*sink);
      out->commit();
    }
    return realizable ? ExitStatus::Realizable : ExitStatus::Unrealizable;
  } catch (const LimitReached &limit) {
    throw LimitReached(limit.kind, limit.what() + (' ' + solver.progress()));
  }
}

ExitStatus print_translation(const Options &options, const Budget &budget) {
  const Specification specification = read(options.file, budget);
  OutFile out(options.outfile);
  translate(specification, out.stream());
  out.commit();
  return ExitStatus::Realizable;
}

ExitStatus dispatch(const std::vector<std::string> &arguments) {
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
  const Budget budget = budget_of(options);
  try {
    return options.translate ? print_translation(options, budget) : solve(options, budget);
  } catch (const LimitReached &limit) {
    if (limit.kind != LimitKind::Memory || options.memory_megabytes)
      throw;
    throw LimitReached(limit.kind, limit.what() + ("; the limit is half of what this machine allows, " +
                                                   std::to_string(budget.memory_bytes >> 20) +
                                                   " MB: --memory MB sets another"));
  }
}

} // namespace

// Catch everything.  `arguments`: without the name of the program.
static ExitStatus run_command(const std::vector<std::string> &arguments) {
  die_with_parent();
  reserve_standard_descriptors();
  catch_signals();
  const auto end = [](ExitStatus status, const std::string &message) {
    std::cerr << message;
    return status;
  };
  try {
    return dispatch(arguments);
  } catch (const InputOutputError &error) {
    // A read or write that a signal cut short is an interrupt, not a failure.
    return interrupted.load() ? end(ExitStatus::Limit, "slugs: interrupted\n")
                              : end(error.status, error.message());
  } catch (const Error &error) {
    return end(error.status, error.message());
  } catch (const std::bad_alloc &) {
    return end(ExitStatus::Limit, "slugs: memory limit reached\n");
  } catch (const std::exception &error) {
    return end(ExitStatus::Internal,
               std::string("slugs: internal error, please report it: ") + error.what() + '\n');
  }
}

} // namespace slugs

int main(int argc, char **argv) {
  return static_cast<int>(slugs::run_command({argv + (argc > 0 ? 1 : 0), argv + argc}));
}
