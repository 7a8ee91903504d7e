// Formulas evaluated on 64 assignments in parallel.
//
// The formulas that are needed become a straight-line program; bit k of each
// word belongs to assignment k.  Values are three-valued (Kleene 1952): one
// word for surely true and one for surely false, so that variables may be left
// open.

#pragma once

#include "core/formula.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

using LaneBits = std::uint64_t;
inline constexpr unsigned lanes = 64;

// Knowledge about one formula or variable on each lane.
struct Truth {
  LaneBits yes = 0;
  LaneBits no = 0;
};

inline Truth known(LaneBits values) { return {values, ~values}; }

// A truth for each variable, current and next value.
struct Assignment {
  explicit Assignment(std::size_t variables) : current(variables), next(variables) {}
  std::vector<Truth> current;
  std::vector<Truth> next;
};

class Evaluation {
public:
  // Covers `roots` and all their operands.  The pool may grow afterwards.
  Evaluation(const FormulaPool &pool, const std::vector<FormulaId> &roots);

  void run(const Assignment &assignment);
  const Truth &operator[](FormulaId id) const { return values_[slot(id)]; }

  // The slot of a needed formula, for repeated queries.
  std::size_t slot(FormulaId id) const;
  const Truth &at(std::size_t slot) const { return values_[slot]; }
  const std::vector<FormulaId> &needed() const { return ids_; } // ascending

private:
  struct Step {
    Op op;
    std::uint32_t left; // slots; of a variable: index and next
    std::uint32_t right;
  };

  std::vector<FormulaId> ids_; // of the slots
  std::vector<Step> steps_;
  std::vector<Truth> values_;
};

} // namespace slugs
