// The two-player game of a specification, as BDDs.
//
// From a state s the environment picks next inputs x' with ENV_TRANS(s, x'),
// then the system sees x' and picks next outputs y' with SYS_TRANS(s, x', y').
// Liveness conditions are about transitions (s, s').

#pragma once

#include "bdd/bdd.hpp"
#include "bdd/reordering.hpp"
#include "core/specification.hpp"
#include "game/conjuncts.hpp"
#include "game/independent_parts.hpp"
#include "game/product.hpp"
#include "game/translation.hpp"

#include <optional>
#include <vector>

namespace slugs {

struct Game {
  Game(const Specification &specification, const std::vector<std::uint32_t> &order, const Budget &budget);
  void build(const Conjuncts &conjuncts, const Environment &environment);

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
  // than its factors, and than for the states that a play can visit.  If the
  // environment has independent parts, only join_parts() makes it and `answerable`,
  // for strategies of the environment.
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

  // What the environment may do in these states, as far as answers depend on it: a
  // set of pairs of a state and next inputs that does not tell apart what is the own
  // present of an independent part.  Narrowing a set of them to the moves from some
  // states is optional, and done where it costs nothing.
  Bdd moves_from(const Bdd &some);
  Bdd narrowed(const Bdd &moves, const Bdd &some) const { return parts_ ? moves : moves & some; }
  // The states from which the environment has any of these moves; if it has
  // independent parts, also states outside of `states`.
  Bdd origins(const Bdd &moves);
  Bdd origins(const Bdd &moves, const Bdd &allowed); // of those that are in both sets
  // Whose conjunction is ENV_TRANS in these states.
  std::vector<Bdd> environment(const Bdd &some);
  // Where it has a move that the system cannot answer at all.
  Bdd stuck_states();
  void join_parts();

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
  // If the environment has independent parts: relations that are multiplied one at a time.
  struct Parts {
    std::vector<Bdd> moves;      // ENV_TRANS: of each part, and the rest
    std::vector<Bdd> answerable; // by what they say something of
    std::optional<Product> move; // from states to moves
    std::optional<Product> undo; // from moves to states
    std::optional<Product> step; // from states to next states
  };
  void build_parts(Translation &translate, const Conjuncts &conjuncts, const Environment &environment,
                   const std::vector<Conjunct> &answers);

  // Of these states, or of the states and moves so far.
  Bdd environment_moves(const Bdd &from) const;

  // The current variables that neither a relation nor a liveness condition reads.
  std::vector<Var> unread();

  std::vector<Bdd> env_factors_; // ENV_TRANS is their conjunction
  std::optional<Parts> parts_;
  std::optional<VarSet> unread_; // none if there are none
};

} // namespace slugs
