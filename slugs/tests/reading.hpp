// Reading a specification from a literal, and evaluating its formulas on one
// valuation: shared by the tests of readers.

#pragma once

#include "certificate/moves/evaluation.hpp"
#include "read/reader.hpp"

#include <cstdint>
#include <sstream>
#include <stdexcept>
#include <string>

namespace reading {

// Throws with all messages if there is an error.
inline slugs::Specification read(const std::string &text) {
  const slugs::Source source("test", text);
  slugs::Diagnostics diagnostics(source);
  slugs::Specification specification = slugs::read_specification(source, diagnostics);
  if (diagnostics.error_count() > 0) {
    std::ostringstream messages;
    diagnostics.print(messages);
    throw std::runtime_error(messages.str() + "in\n" + text);
  }
  return specification;
}

// A formula to be evaluated on successive valuations.
class Value {
public:
  Value(const slugs::Specification &specification, slugs::FormulaId formula)
      : formula_(formula), evaluation_(specification.formulas, {formula}),
        assignment_(specification.variables.size()) {}

  // Bit i of `current` and `next` is the value of variable i.
  bool operator()(std::uint64_t current, std::uint64_t next) {
    for (std::size_t i = 0; i < assignment_.current.size(); ++i) {
      assignment_.current[i] = slugs::known((current >> i) & 1 ? ~slugs::LaneBits{0} : 0);
      assignment_.next[i] = slugs::known((next >> i) & 1 ? ~slugs::LaneBits{0} : 0);
    }
    evaluation_.run(assignment_);
    const slugs::Truth truth = evaluation_[formula_];
    if (truth.yes != ~truth.no)
      throw std::logic_error("a formula has no value on a complete assignment");
    return truth.yes != 0;
  }

private:
  slugs::FormulaId formula_;
  slugs::Evaluation evaluation_;
  slugs::Assignment assignment_;
};

inline bool holds(const slugs::Specification &specification, slugs::FormulaId formula, std::uint64_t current,
                  std::uint64_t next = 0) {
  return Value(specification, formula)(current, next);
}

// The only constraint of a section.
inline slugs::FormulaId only(const slugs::Specification &specification, slugs::Section section) {
  if (specification[section].size() != 1)
    throw std::logic_error("expected one constraint");
  return specification[section][0].formula;
}

} // namespace reading
