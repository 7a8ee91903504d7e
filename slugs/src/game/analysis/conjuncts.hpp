// The conjuncts of the constraints of a specification, and the variables they read.
//
// Computed once for the start order of the variables and the game.  Each node of a
// formula is visited at most twice, and no nodes are added to the formula pool.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace slugs {

// An occurrence of a current or next variable in a formula.
struct Read {
  std::uint32_t variable : 31; // index into Specification::variables
  std::uint32_t next : 1;
};

// A formula or its negation.
struct Conjunct {
  FormulaId formula;
  bool negative;
  std::uint32_t read_count;
  std::size_t first_read;
};

class Conjuncts {
public:
  Conjuncts(const Specification &specification, const Budget &budget);

  // Return the conjuncts of a section without duplicates, after flattening nested
  // conjunctions and negated disjunctions.
  const std::vector<Conjunct> &operator[](Section section) const { return all_[index(section)]; }
  // Return the conjuncts of each constraint in turn, as indices into operator[].
  const std::vector<std::uint32_t> &occurrences(Section section) const {
    return occurrences_[index(section)];
  }

  // The current and next variables that a conjunct reads, without duplicates.
  struct Reads {
    const Read *first;
    const Read *last;
    const Read *begin() const { return first; }
    const Read *end() const { return last; }
  };
  Reads reads(const Conjunct &conjunct) const {
    const Read *first = reads_.data() + conjunct.first_read;
    return {first, first + conjunct.read_count};
  }

private:
  static std::size_t index(Section section) { return static_cast<std::size_t>(section); }

  std::array<std::vector<Conjunct>, section_count> all_;
  std::array<std::vector<std::uint32_t>, section_count> occurrences_;
  std::vector<Read> reads_;
};

} // namespace slugs
