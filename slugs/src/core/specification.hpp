// The output of the readers: variables and six lists of constraints over one pool of
// formulas.  The solver does not depend on the input language, nor the readers on
// the solver.

#pragma once

#include "core/formula.hpp"

#include <array>
#include <cassert>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace slugs {

enum class Owner : std::uint8_t { Input, Output };

// One bit.  Specification::variables is in declaration order (in structuredslugs
// all inputs come first), which fixes the lexicographic order of states and the
// order in which a strategy prints their bits.
struct Variable {
  std::string name;
  Owner owner;
  int line; // line of its declaration, from 1
};

// An integer of a structured file: value - min as little-endian bits
// variables[first] .. variables[first + bits - 1]; bits may be 0.
struct Integer {
  std::string name;
  Owner owner;
  std::int64_t min;
  std::int64_t max;
  std::uint32_t first;
  std::uint32_t bits;
  int line;
};

enum class Section : std::uint8_t { EnvInit, SysInit, EnvTrans, SysTrans, EnvLiveness, SysLiveness };
inline constexpr std::size_t section_count = 6;
inline constexpr std::array<const char *, section_count> section_names = {
    "ENV_INIT", "SYS_INIT", "ENV_TRANS", "SYS_TRANS", "ENV_LIVENESS", "SYS_LIVENESS"};

// Packed, since a specification may have millions.
struct Constraint {
  FormulaId formula;
  int line;                // source line, from 1
  std::uint64_t text : 52; // offset in Specification::texts
  std::uint64_t text_length : 11;
  std::uint64_t range_limit : 1; // whether an integer's declaration generated it
};

static_assert(sizeof(Constraint) == 16);

struct Specification {
  std::string file; // as named on the command line, "-" for standard input
  FormulaPool formulas;
  std::vector<Variable> variables;
  std::vector<Integer> integers;
  std::array<std::vector<Constraint>, section_count> constraints;
  std::string texts; // source texts of all constraints

  void add(Section section, FormulaId formula, int line, std::string_view text, bool range_limit) {
    constexpr std::size_t longest_text = 1000; // for messages
    static_assert(longest_text < 1u << 11);
    text = text.substr(0, longest_text);
    assert(formula < formulas.size() && line >= 1);
    assert(texts.size() >> 52 == 0);
    (*this)[section].push_back({formula, line, texts.size(), text.size(), range_limit});
    texts += text;
  }
  // Return the source text; "name:min...max" for a range limit.
  std::string_view text(const Constraint &constraint) const {
    assert(constraint.text + constraint.text_length <= texts.size());
    return std::string_view(texts).substr(constraint.text, constraint.text_length);
  }

  std::vector<Constraint> &operator[](Section s) { return constraints[static_cast<std::size_t>(s)]; }
  const std::vector<Constraint> &operator[](Section s) const {
    return constraints[static_cast<std::size_t>(s)];
  }
};

} // namespace slugs
