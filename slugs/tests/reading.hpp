// Reading a specification from a literal, and evaluating its formulas on one
// valuation: shared by the tests of readers.

#pragma once

#include "read/reader.hpp"

#include <cstdint>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

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

// The value of a formula if bit i of `current` and `next` is the value of variable i.
inline bool holds(const slugs::Specification &specification, slugs::FormulaId formula, std::uint64_t current,
                  std::uint64_t next = 0) {
  const slugs::FormulaPool &pool = specification.formulas;
  std::vector<bool> value(formula + 1); // operands have smaller ids
  for (slugs::FormulaId id = 0; id <= formula; ++id) {
    const slugs::FormulaNode &node = pool[id];
    switch (node.op) {
    case slugs::Op::False:
    case slugs::Op::True:
      value[id] = node.op == slugs::Op::True;
      break;
    case slugs::Op::Variable:
      value[id] = ((node.right ? next : current) >> node.left) & 1;
      break;
    case slugs::Op::Not:
      value[id] = !value[node.left];
      break;
    case slugs::Op::And:
      value[id] = value[node.left] && value[node.right];
      break;
    case slugs::Op::Or:
      value[id] = value[node.left] || value[node.right];
      break;
    case slugs::Op::Xor:
      value[id] = value[node.left] != value[node.right];
      break;
    }
  }
  return value[formula];
}

// The only constraint of a section.
inline slugs::FormulaId only(const slugs::Specification &specification, slugs::Section section) {
  if (specification[section].size() != 1)
    throw std::logic_error("expected one constraint");
  return specification[section][0].formula;
}

} // namespace reading
