// Reading a specification from a literal, and evaluating its formulas on one
// valuation: what the tests of readers share.

#pragma once

#include "certificate/moves/evaluation.hpp"
#include "read/reader.hpp"

#include <cstdint>
#include <sstream>
#include <stdexcept>
#include <string>

namespace reading {

// Throws with all messages if there is a mistake.
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

// Bit i of `current` and `next` is the value of variable i.
inline bool holds(const slugs::Specification &specification, slugs::FormulaId formula, std::uint64_t current,
                  std::uint64_t next = 0) {
  slugs::Evaluation evaluation(specification.formulas, {formula});
  slugs::Assignment assignment(specification.variables.size());
  for (std::size_t i = 0; i < specification.variables.size(); ++i) {
    assignment.current[i] = slugs::known((current >> i) & 1 ? ~slugs::LaneBits{0} : 0);
    assignment.next[i] = slugs::known((next >> i) & 1 ? ~slugs::LaneBits{0} : 0);
  }
  evaluation.run(assignment);
  const slugs::Truth truth = evaluation[formula];
  if (truth.yes != ~truth.no)
    throw std::logic_error("a formula has no value on a complete assignment");
  return truth.yes != 0;
}

// The only constraint of a section.
inline slugs::FormulaId only(const slugs::Specification &specification, slugs::Section section) {
  if (specification[section].size() != 1)
    throw std::logic_error("expected one constraint");
  return specification[section][0].formula;
}

} // namespace reading
