// What the constraints of a specification consist of, and which variables they read.
//
// Found once, and shared by the start order of the variables and the game.  Every
// node of a formula is visited at most twice, and nothing is added to the formulas.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace slugs {

// A variable as a formula reads it.
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

  // Whose conjunction the constraints of the section are, each once; found through
  // nested conjunctions and negated disjunctions.
  const std::vector<Conjunct> &operator[](Section section) const { return all_[index(section)]; }
  // Constraint by constraint, which of them it consists of.
  const std::vector<std::uint32_t> &occurrences(Section section) const {
    return occurrences_[index(section)];
  }

  // Each present and each next value that the formula reads, once.
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
