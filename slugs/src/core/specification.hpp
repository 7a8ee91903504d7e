// A specification as the readers hand it over: variables and six lists of
// constraints over one pool of formulas.  Data only; no solver knows the input
// language and no reader knows the solver.

#pragma once

#include "core/formula.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace slugs {

enum class Owner : std::uint8_t { Input, Output };

// One bit.  Specification::variables is in declaration order (in structuredslugs
// all inputs come first), which fixes the lexicographic order of states and the
// order in which a strategy prints their bits.
struct Variable {
  std::string name;
  Owner owner;
  int line; // of its declaration, from 1
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

struct Constraint {
  FormulaId formula;
  int line;         // of the source, from 1
  std::string text; // as written; for a range limit: "name:min...max"
  bool range_limit; // generated from an integer's declaration
};

struct Specification {
  std::string file; // as named on the command line, "-" for standard input
  FormulaPool formulas;
  std::vector<Variable> variables;
  std::vector<Integer> integers;
  std::array<std::vector<Constraint>, section_count> constraints;

  std::vector<Constraint> &operator[](Section s) { return constraints[static_cast<std::size_t>(s)]; }
  const std::vector<Constraint> &operator[](Section s) const {
    return constraints[static_cast<std::size_t>(s)];
  }
};

} // namespace slugs
