// Remainders of constraints when some variables are known: formulas over the
// open ones.
//
// The constraints are evaluated for 64 queries in parallel with the open variables
// unknown, which decides most of them.  The others are rewritten, for one query at
// a time, in a hash-consed pool, so that equal remainders have equal ids.

#pragma once

#include "certificate/moves/evaluation.hpp"
#include "core/specification.hpp"

#include <array>
#include <map>
#include <optional>
#include <vector>

namespace slugs {

// A variable that a query leaves open.
struct OpenVariable {
  std::uint32_t index;
  bool next;
};

class Remainders {
public:
  using Conjunction = std::vector<FormulaId>; // sorted, no constants

  Remainders(const Specification &specification, std::vector<OpenVariable> open,
             const std::vector<Section> &sections);

  // Set the known variables of up to 64 queries; open ones are ignored.
  void load(Assignment assignment);

  // Return the remainder of a section for one query; nothing if the section is
  // violated.
  std::optional<Conjunction> remainder(Section section, unsigned lane);

  // Return the sorted positions, in the list of open variables, that a
  // remainder's formula mentions.
  const std::vector<std::uint32_t> &support(FormulaId formula);
  // Return a formula with these values substituted at some positions.
  FormulaId substitute(FormulaId formula, const std::vector<std::optional<bool>> &values);

  FormulaPool &pool() { return pool_; }
  const std::vector<OpenVariable> &open() const { return open_; }
  std::size_t variable_count() const { return position_.size(); }

private:
  FormulaId rewrite(FormulaId root, unsigned lane);
  // `settle(id)` returns whether rewritten_[id] is known, and may set it; all
  // others are rewritten from their operands.
  template <class Settle> FormulaId rebuild(FormulaId root, Settle settle);

  const Specification &specification_;
  FormulaPool pool_; // begins as the specification's, so that ids agree
  std::vector<OpenVariable> open_;
  std::vector<std::array<std::uint32_t, 2>> position_; // of each variable, current and next
  Evaluation evaluation_;
  std::vector<std::uint32_t> slots_; // of the formulas that evaluation_ needs
  std::vector<bool> only_open_;      // formulas of the specification without a known variable

  std::vector<FormulaId> rewritten_; // valid where the stamp is current
  std::vector<std::uint64_t> stamp_;
  std::uint64_t now_ = 0;
  std::map<FormulaId, std::vector<std::uint32_t>> supports_;
};

} // namespace slugs
