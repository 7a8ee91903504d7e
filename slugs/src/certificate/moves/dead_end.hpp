// Search for a move of the environment to which the system has no answer.
//
// There may be millions of moves, so they are not tried one by one.  Instead
// (Janota et al., Solving QBF with counterexample guided refinement, SAT 2012):
// guess a move, look for an answer to it, and if there is one, look from then
// on only for moves to which this answer is illegal.

#pragma once

#include "certificate/moves/remainders.hpp"
#include "core/budget.hpp"

namespace slugs {

class DeadEnds {
public:
  enum class Kind {
    SystemStuck,      // after some move
    EnvironmentStuck, // there is no move
    None
  };

  // Moves satisfy `env` and are inputs; answers satisfy `sys` and are outputs.
  DeadEnds(const Specification &specification, Section env, Section sys, std::vector<OpenVariable> inputs,
           const std::vector<OpenVariable> &outputs, const Budget &budget);

  // Search from the state on lane 0 of the assignment.
  Kind search(const Assignment &assignment);

private:
  using Values = std::vector<std::optional<bool>>; // of the open variables

  // Return values that satisfy all formulas, irrelevant ones false; nothing if
  // there are none.
  std::optional<Values> solve(const Remainders::Conjunction &formulas);
  // Return the remaining conjuncts; nothing if one is false.
  std::optional<Remainders::Conjunction> substitute(const Remainders::Conjunction &formulas,
                                                    const Values &values);

  const Section env_;
  const Section sys_;
  const std::uint32_t input_count_;
  Remainders remainders_;
  const Budget &budget_;
};

} // namespace slugs
