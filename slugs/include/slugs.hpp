// slugs as a library: GR(1) synthesis in one class.
//
//   #include "slugs.hpp"
//   #include <iostream>
//
//   int main() {
//     slugs::Synthesis synthesis("[INPUT]\n"
//                                "request\n"
//                                "[OUTPUT]\n"
//                                "floor: 0...3\n"
//                                "[SYS_INIT]\n"
//                                "floor = 0\n"
//                                "[SYS_TRANS]\n"
//                                "floor' <= floor + 1 & floor <= floor' + 1\n"
//                                "[ENV_LIVENESS]\n"
//                                "request'\n"
//                                "[SYS_LIVENESS]\n"
//                                "request & floor = 3\n"
//                                "floor = 0\n");
//     if (!synthesis.realizable()) {
//       std::cout << synthesis.counterstrategy();
//       return 1;
//     }
//     const std::string strategy = synthesis.strategy();
//     const slugs::Synthesis::Check check = synthesis.check_strategy(strategy);
//     std::cout << (check.accepted ? strategy : check.reason);
//   }
//
// The specification is slugsin or structuredslugs; its content decides which.
// There is no global state: objects are independent, and each may be used by one
// thread at a time.

#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <iosfwd>
#include <memory>
#include <stdexcept>
#include <string>

namespace slugs {

// what() lists all errors in the format of the command: location, source line,
// caret, hint.
struct InvalidSpecification : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

// A limit was reached or the run was interrupted; what() reports the progress.
struct Stopped : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Synthesis {
public:
  struct Settings {
    bool robotics_init = false;   // every state with ENV_INIT & SYS_INIT must be winning
    bool bias_for_action = false; // prefer moves towards a goal to waiting for an assumption
    // Time limit from construction; default: none.
    std::chrono::duration<double> time = std::chrono::duration<double>::max();
    std::size_t memory_bytes = static_cast<std::size_t>(-1); // limit of the solver's tables
    const std::atomic<bool> *interrupted = nullptr;          // stop request, polled while solving
  };

  struct Check {
    bool accepted;
    std::string reason; // reason for a rejection, else empty
  };

  // `name`: name of the specification in messages.  Throws InvalidSpecification.
  explicit Synthesis(std::string text);
  Synthesis(std::string text, const Settings &settings, std::string name = "specification");
  ~Synthesis();
  Synthesis(Synthesis &&) noexcept;
  Synthesis &operator=(Synthesis &&) noexcept;

  // Return warnings about legal but suspicious parts, in the format of InvalidSpecification.
  std::string warnings() const;

  // Solve the game on the first call and return the verdict.  Throws Stopped; afterwards
  // only statistics() and functions that do not solve may be called.
  bool realizable();

  // Return or write the explicit strategy of the system or of the environment as JSON.
  // Throw std::logic_error if the other player wins, and Stopped, which leaves the output
  // incomplete.
  std::string strategy();
  void strategy(std::ostream &out);
  std::string counterstrategy();
  void counterstrategy(std::ostream &out);

  // Model-check an explicit strategy without the solver.  Throw std::invalid_argument if
  // the text is not a strategy, and Stopped.
  Check check_strategy(const std::string &json) const;
  Check check_counterstrategy(const std::string &json) const;

  std::string slugsin() const;    // the specification in slugsin
  std::string statistics() const; // statistics of the run so far, as JSON

  static const char *version();

private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

} // namespace slugs
