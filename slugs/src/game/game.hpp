// The two-player game of a specification, as BDDs.
//
// From a state s the environment picks next inputs x' with ENV_TRANS(s, x'),
// then the system sees x' and picks next outputs y' with SYS_TRANS(s, x', y').
// Liveness conditions speak of transitions (s, s').

#pragma once

#include "bdd/bdd.hpp"
#include "bdd/reordering.hpp"
#include "core/specification.hpp"

#include <optional>
#include <vector>

namespace slugs {

struct Game {
  Game(const Specification &specification, const std::vector<std::uint32_t> &order, const Budget &budget);
  void build();

  const Specification &specification;
  BddStore store; // bit i is specification.variables[i]
  Reordering reordering;
  VarSet current_inputs;
  VarSet current_outputs;
  VarSet current;
  VarSet next_inputs;
  VarSet next_outputs;
  VarSet next;

  Bdd env_init;
  Bdd sys_init;
  // Only restrict_to() makes this one diagram.  For all states it can be far larger
  // than its factors, and than for the states that a play can visit.
  Bdd env_trans;
  // SYS_TRANS is the conjunction of these two.  What it says of the present and the
  // next inputs alone: after any other move of the environment the system is stuck.
  // And the rest, which is all that matters where this holds.
  Bdd answerable;
  Bdd sys_trans;
  std::vector<Bdd> assumptions; // ENV_LIVENESS; at least one
  std::vector<Bdd> guarantees;  // SYS_LIVENESS; at least one

  Bdd states; // where the environment relation holds any move
  // The game in these states only.  Once, after build().
  void restrict_to(const Bdd &states);

  // States to which one step of both players can lead.
  Bdd image(const Bdd &from);

  // And all that differ from these only in present values that nothing reads. From
  // such states the same can happen, so sets of them need not tell them apart.
  Bdd with_alike(const Bdd &some);
  bool tells_all_apart() const { return !unread_; }

  // The verdict on a winning set: realizable?
  bool wins_initially(const Bdd &winning, bool robotics_init);

  std::vector<Var> current_vars() const;

private:
  // Of these states, or of the states and moves so far.
  Bdd environment_moves(const Bdd &from) const;

  // The current variables that neither a relation nor a liveness condition reads.
  std::vector<Var> unread();

  std::vector<Bdd> env_factors_; // ENV_TRANS is their conjunction
  std::optional<VarSet> unread_; // none if there are none
};

} // namespace slugs
