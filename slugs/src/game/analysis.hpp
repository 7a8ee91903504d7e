// Analysis of a specification without BDDs: conjuncts, independent parts, initial variable order.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"

#include <array>
#include <cassert>
#include <cstdint>
#include <vector>

namespace slugs {

// The conjuncts of the constraints of a specification, and the variables they read.
//
// Computed once for the initial order of the variables and the game.  Each node of a
// formula is visited at most twice, and no nodes are added to the formula pool.

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
    assert(conjunct.first_read + conjunct.read_count <= reads_.size());
    const Read *first = reads_.data() + conjunct.first_read;
    return {first, first + conjunct.read_count};
  }

private:
  static std::size_t index(Section section) {
    assert(static_cast<std::size_t>(section) < section_count);
    return static_cast<std::size_t>(section);
  }

  std::array<std::vector<Conjunct>, section_count> all_;
  std::array<std::vector<std::uint32_t>, section_count> occurrences_;
  std::vector<Read> reads_;
};

// Independent parts of the environment.
//
// Constraints of ENV_TRANS form a group if they read a common next input, directly or
// through a chain of other constraints.  Given the state, the next inputs of different
// groups are independent.  A group is a part if it has own inputs: inputs whose current
// values are read neither by the rest of ENV_TRANS, nor by SYS_TRANS constraints on
// next outputs, nor by liveness conditions.  Several other robots that move
// independently are such parts.

struct IndependentPart {
  std::vector<Conjunct> constraints;
  std::vector<std::uint32_t> own; // own inputs, ascending
};

struct Environment {
  std::vector<IndependentPart> parts; // none or at least two
  std::vector<Conjunct> shared;       // the other constraints of ENV_TRANS
};

Environment independent_parts(const Specification &specification, const Conjuncts &conjuncts,
                              const Budget &budget);

// The initial variable order.

// Return an order that places variables of the same constraint near each other:
// order[k] is the variable at position k.
std::vector<std::uint32_t> force_order(std::size_t variables, const Conjuncts &conjuncts,
                                       const Budget &budget);

// Move hubs to the top: variables with far more occurrences than the median
// variable.  FORCE places them amid the variables that they interact with, and
// diagrams must then encode all variables above them.  For example, the position of a
// lift selects the relevant button, so it belongs above the buttons.
std::vector<std::uint32_t> hubs_first(std::vector<std::uint32_t> order, const Conjuncts &conjuncts,
                                      const Tuning &tuning);

// Return the order of FORCE with hubs first and the inputs of each independent part of
// the environment contiguous: the first part above all shared variables, the others
// below.  Given the shared variables, parts are independent, so the size of diagrams
// grows with the sum of the parts' sizes; with two parts above the shared variables it
// would grow with their product.
std::vector<std::uint32_t> start_order(std::size_t variables, const Conjuncts &conjuncts,
                                       const std::vector<IndependentPart> &parts, const Budget &budget);

} // namespace slugs
