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
// The text is slugsin or structuredslugs, told apart by content.  There is no
// global state: any number of objects may live side by side, each used by one
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

// what() holds all mistakes of the text as the command prints them: place,
// source line, caret, hint.
struct InvalidSpecification : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

// A limit was reached or the run was interrupted; what() says how far it got.
struct Stopped : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Synthesis {
public:
  struct Settings {
    bool robotics_init = false;   // every position with ENV_INIT & SYS_INIT must be winning
    bool bias_for_action = false; // prefer moves towards a goal to waiting for an assumption
    // From the construction on; the default never ends.
    std::chrono::duration<double> time = std::chrono::duration<double>::max();
    std::size_t memory_bytes = static_cast<std::size_t>(-1); // of the solver's tables
    const std::atomic<bool> *interrupted = nullptr;          // stops when it becomes true
  };

  struct Check {
    bool accepted;
    std::string reason; // of a rejection
  };

  // `name` stands for the text in messages.  Throws InvalidSpecification.
  explicit Synthesis(std::string text);
  Synthesis(std::string text, const Settings &settings, std::string name = "specification");
  ~Synthesis();
  Synthesis(Synthesis &&) noexcept;
  Synthesis &operator=(Synthesis &&) noexcept;

  // What may be wrong though it is legal, in the form of InvalidSpecification.
  std::string warnings() const;

  // Solves at the first call.  Throws Stopped, after which only statistics()
  // and what does not solve can be called.
  bool realizable();

  // The explicit strategy as JSON, of the system or of the environment.  Throw
  // std::logic_error if the verdict is the other one, Stopped.  What a stream
  // has received before Stopped is incomplete.
  std::string strategy();
  void strategy(std::ostream &out);
  std::string counterstrategy();
  void counterstrategy(std::ostream &out);

  // Model checking without the solver.  Throws std::invalid_argument if the
  // text is not a strategy, Stopped.
  Check check_strategy(const std::string &json) const;
  Check check_counterstrategy(const std::string &json) const;

  std::string slugsin() const;    // the specification in slugsin
  std::string statistics() const; // of the run so far, as JSON

  static const char *version();

private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

} // namespace slugs
