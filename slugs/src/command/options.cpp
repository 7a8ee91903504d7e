// The table of options, its parser and the help.

#include "command/options.hpp"

#include "read/diagnostics.hpp"

#include <cassert>
#include <charconv>
#include <cmath>
#include <ostream>

#ifndef SLUGS_VERSION
#error "the build defines SLUGS_VERSION"
#endif

namespace slugs {

const char *const version = SLUGS_VERSION;

namespace {

struct Row {
  const char *name;
  const char *value; // its name in the help, nullptr for a flag
  const char *help;
  bool Options::*flag;
  void (*set)(Options &, const std::string &name, const std::string &value);
};

double positive_number(const std::string &name, const std::string &value) {
  double number = 0;
  const char *end = value.data() + value.size();
  const auto [stop, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc() || stop != end || !std::isfinite(number) || number <= 0)
    throw UsageError("found '" + value + "' after " + name + ", expected a positive number");
  return number;
}

void set_timeout(Options &options, const std::string &name, const std::string &value) {
  options.timeout_seconds = positive_number(name, value);
}
void set_memory(Options &options, const std::string &name, const std::string &value) {
  constexpr double most = 1e12; // megabytes; keeps the conversions exact
  options.memory_megabytes =
      static_cast<std::size_t>(std::ceil(std::min(positive_number(name, value), most)));
}
void set_nodes(Options &options, const std::string &name, const std::string &value) {
  std::size_t number = 0;
  const char *end = value.data() + value.size();
  const auto [stop, error] = std::from_chars(value.data(), end, number);
  if (error != std::errc() || stop != end || number == 0)
    throw UsageError("found '" + value + "' after " + name + ", expected a positive whole number");
  assert(number > 0);
  options.most_nodes = number;
}

// A row without a setter is the heading of a group.
constexpr Row rows[] = {
    {"Mode (default: report whether the specification is realizable)", nullptr, nullptr, nullptr, nullptr},
    {"--realizability", nullptr, "only report whether it is realizable", &Options::realizability, nullptr},
    {"--explicitStrategy", nullptr, "print a strategy if it is realizable", &Options::explicit_strategy,
     nullptr},
    {"--counterStrategy", nullptr,
     "print a counterstrategy if it is unrealizable; with\n"
     "--explicitStrategy: the one that exists",
     &Options::counter_strategy, nullptr},
    {"--translate", nullptr, "print FILE in slugsin", &Options::translate, nullptr},
    {"Output", nullptr, nullptr, nullptr, nullptr},
    {"--jsonOutput", nullptr, "strategies as JSON instead of text", &Options::json_output, nullptr},
    {"Semantics", nullptr, nullptr, nullptr, nullptr},
    {"--sysInitRoboticsSemantics", nullptr,
     "all positions that ENV_INIT and SYS_INIT allow must be\n"
     "winning, not one output for each input",
     &Options::robotics_init, nullptr},
    {"--biasForAction", nullptr,
     "prefer moves towards a goal to moves that wait for an\n"
     "assumption",
     &Options::bias_for_action, nullptr},
    {"Limits", nullptr, nullptr, nullptr, nullptr},
    {"--timeout", "SECONDS", "stop after this time", nullptr, set_timeout},
    {"--memory", "MB",
     "stop before using more memory than this (default: half\n"
     "of what the machine allows)",
     nullptr, set_memory},
    {"--nodes", "COUNT", "stop if the strategy has more nodes than this", nullptr, set_nodes},
    {"About", nullptr, nullptr, nullptr, nullptr},
    {"--help", nullptr, "print this text", &Options::help, nullptr},
    {"--version", nullptr, "print the version", &Options::version, nullptr},
};

// Options of the SLUGS of Ehlers and Raman that this program does not have.
constexpr const char *unsupported[] = {
    "--symbolicStrategy",
    "--simpleSymbolicStrategy",
    "--interactiveStrategy",
    "--onlyRealizability",
    "--nonDeterministicMotion",
    "--twoDimensionalCost",
    "--IROSfastslow",
    "--extractExplicitPermissiveStrategy",
    "--restrictToReachableStates",
    "--cooperativeGR1Strategy",
    "--fixedPointRecycling",
    "--analyzeInterleaving",
    "--analyzeInitialPositions",
    "--analyzeAssumptions",
    "--analyzeSafetyLivenessInteraction",
    "--computeAbstractWinningTrace",
    "--computeCNFFormOfTheSpecification",
    "--computeIncompleteInformationEstimator",
    "--computeInterestingRunOfTheSystem",
    "--computeWeakenedSafetyAssumptions",
    "--counterStrategyWithoutDeadlocks",
    "--optimisticRecovery",
    "--useGurobi",
};

const char *common_hint = "'slugs --help' lists the options";

const Row *find_row(const std::string &name) {
  for (const Row &row : rows)
    if ((row.flag || row.set) && name == row.name)
      return &row;
  if (name == "-h")
    return find_row("--help");
  return nullptr;
}

[[noreturn]] void unknown_option(const std::string &name) {
  for (const char *option : unsupported)
    if (name == option)
      throw UsageError("option " + name + " of SLUGS is not supported",
                       name == "--onlyRealizability" ? "use --realizability" : common_hint);
  std::vector<std::string> known;
  for (const Row &row : rows)
    if (row.flag || row.set)
      known.emplace_back(row.name);
  const std::string nearest = nearest_word(name, known);
  throw UsageError("unknown option '" + name + "'",
                   nearest.empty() ? common_hint : "did you mean " + nearest + "?");
}

// Reject options that contradict each other, or that need another one.
void check_combination(const Options &options) {
  const bool strategy = options.explicit_strategy || options.counter_strategy;
  if (options.file.empty())
    throw UsageError("no input FILE given", "'-' reads standard input; 'slugs --help' shows examples");
  if (options.translate && (strategy || options.realizability || options.json_output))
    throw UsageError("--translate only prints the specification and takes no option about strategies");
  if (options.realizability && strategy)
    throw UsageError("--realizability and a strategy exclude each other");
  if (options.json_output && !strategy)
    throw UsageError("--jsonOutput needs --explicitStrategy or --counterStrategy");
  if (options.most_nodes && !options.explicit_strategy)
    throw UsageError("--nodes limits what --explicitStrategy lists");
  if (!options.outfile.empty() && !strategy && !options.translate)
    throw UsageError("OUTFILE '" + options.outfile + "' has no use here",
                     "a strategy is printed with --explicitStrategy");
}

} // namespace

std::string UsageError::message() const {
  return Error::message() + (hint_.empty() ? "" : "  hint: " + hint_ + "\n") +
         "  usage: slugs [options] FILE [OUTFILE]\n";
}

Options parse_options(const std::vector<std::string> &arguments) {
  Options options;
  std::vector<std::string> files;
  bool only_files = false;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string &argument = arguments[i];
    if (only_files || argument == "-" || argument.empty() || argument[0] != '-') {
      files.push_back(argument);
      continue;
    }
    if (argument == "--") {
      only_files = true;
      continue;
    }
    const std::size_t equals = argument.find('=');
    const std::string name = argument.substr(0, equals);
    const Row *row = find_row(name);
    if (!row)
      unknown_option(name);
    if (row->flag) {
      if (equals != std::string::npos)
        throw UsageError("option " + name + " takes no value");
      options.*(row->flag) = true;
      continue;
    }
    if (equals == std::string::npos && i + 1 == arguments.size())
      throw UsageError("option " + name + " needs a value: " + row->value);
    assert(row->set && row->value);
    row->set(options, name, equals == std::string::npos ? arguments[++i] : argument.substr(equals + 1));
  }
  if (options.help || options.version)
    return options;
  for (const std::string &file : files)
    if (file.empty())
      throw UsageError("found an empty file name");
  if (files.size() > 2)
    throw UsageError("found '" + files[2] + "', expected at most FILE and OUTFILE");
  if (!files.empty())
    options.file = files[0];
  if (files.size() > 1 && files[1] != "-")
    options.outfile = files[1];
  check_combination(options);
  assert(!options.file.empty());
  return options;
}

void print_help(std::ostream &out) {
  out << "slugs " << version << ": synthesis of strategies from GR(1) specifications\n"
      << "\nUsage: slugs [options] FILE [OUTFILE]\n"
      << "\nFILE is in slugsin or structuredslugs, detected by content; '-' is standard\n"
         "input. The verdict goes to standard error, a strategy to OUTFILE or standard\n"
         "output ('-').\n";
  constexpr std::size_t column = 30;
  for (const Row &row : rows) {
    if (!row.flag && !row.set) {
      out << '\n' << row.name << ":\n";
      continue;
    }
    std::string left = "  " + std::string(row.name) + (row.value ? " " + std::string(row.value) : "");
    left.resize(std::max(column, left.size() + 2), ' ');
    out << left;
    for (const char *c = row.help; *c; ++c) {
      out << *c;
      if (*c == '\n')
        out << std::string(column, ' ');
    }
    out << '\n';
  }
  out << "\nExamples:\n"
         "  slugs robot.structuredslugs\n"
         "  slugs --explicitStrategy --jsonOutput robot.structuredslugs strategy.json\n"
         "  slugs --counterStrategy --jsonOutput --timeout 60 robot.structuredslugs\n"
         "  slugs --translate robot.structuredslugs robot.slugsin\n"
         "\nExit status:\n"
         "  0   realizable; translated\n"
         "  2   bad input or usage\n"
         "  3   limit reached, or interrupted\n"
         "  4   internal error, or the output could not be written\n"
         "  10  unrealizable\n";
}

} // namespace slugs
