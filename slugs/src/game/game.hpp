// The game as BDDs: translation of formulas, relational products, steps, reachable states.

#pragma once

#include "bdd/bdd.hpp"
#include "bdd/reordering.hpp"
#include "core/budget.hpp"
#include "core/formula.hpp"
#include "core/specification.hpp"
#include "game/analysis.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace slugs {

// Translation of formulas to BDDs.
//
// Formulas may be deep, so operators are translated in the order of their ids, operands
// first, without recursion.  Intermediate results are dropped after their last use, since
// collections and reorderings would have to process them.

class Translation {
public:
  // Variable v of the formulas corresponds to current_var(v) and next_var(v) of the store.
  Translation(BddStore &store, const FormulaPool &formulas);

  Bdd operator()(FormulaId formula);

private:
  bool is_operator(FormulaId id) const { return formulas_[id].op >= Op::Not; }
  Bdd take(FormulaId id);
  void keep(FormulaId id, const Bdd &value);
  void bring_into_order(std::vector<FormulaId> &needed);

  BddStore &store_;
  const FormulaPool &formulas_;
  BudgetPacer pacer_;
  // Operators of the formula in translation, indexed by id:
  std::vector<std::uint32_t> uses_;  // remaining uses
  std::vector<std::uint32_t> place_; // index into values_
  std::vector<Bdd> values_;
  std::vector<std::uint32_t> free_places_;
};

// Relational product of a set with several relations: exists V. f & r_1 & ... & r_n.
//
// The relations are conjoined in turn, and each variable is quantified as soon as no
// later relation reads it ("early quantification": Burch, Clarke and Long 1991).  So
// an intermediate result relates current and next values of one relation at most,
// which is decisive if the relations are independent.

class Product {
public:
  // `relations`: in the order of their conjunction.
  Product(BddStore &store, const std::vector<Bdd> &relations, const std::vector<Var> &quantified);
  Bdd operator()(const Bdd &f) const;

private:
  struct Factor {
    Bdd relation;
    VarSet dropped; // quantified variables that no later relation reads
  };

  BddStore &store_;
  VarSet unread_; // quantified variables that no relation reads
  std::vector<Factor> factors_;
};

// The two-player game of a specification, as BDDs.
//
// From a state s the environment picks next inputs x' with ENV_TRANS(s, x'),
// then the system sees x' and picks next outputs y' with SYS_TRANS(s, x', y').
// Liveness conditions refer to transitions (s, s').

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
  // ENV_TRANS in `states`, valid after restrict_to(): on all states it can be far larger
  // than its factors and than on the reachable states.  If the environment has
  // independent parts, this and `answerable` are valid only after join_parts(), which
  // strategies of the environment need.
  Bdd env_trans;
  // SYS_TRANS is the conjunction of these two.  `answerable` consists of its constraints
  // on current values and next inputs: after any other move of the environment the
  // system is stuck.  `sys_trans` consists of the constraints on next outputs.
  Bdd answerable;
  Bdd sys_trans;
  std::vector<Bdd> assumptions; // ENV_LIVENESS; at least one
  std::vector<Bdd> guarantees;  // SYS_LIVENESS; at least one

  Bdd states; // states to which the game is restricted
  // Restrict the game to these states.  Call it once, after build().
  void restrict_to(const Bdd &states);

  // Return the moves of the environment from these states: pairs of a state and next
  // inputs.  If the environment has independent parts, the variables that only a part
  // itself reads are quantified, since the system's responses do not depend on them.
  Bdd moves_from(const Bdd &some);
  // Restrict moves to these states where that is cheap, and else return all of them.
  Bdd narrowed(const Bdd &moves, const Bdd &some) const { return parts_ ? moves : moves & some; }
  // Return the states from which the environment has one of these moves; if it has
  // independent parts, also states outside of `states`.
  Bdd sources(const Bdd &moves);
  Bdd sources(const Bdd &moves, const Bdd &allowed); // sources of the intersection
  // Return relations whose conjunction is ENV_TRANS on these states.
  std::vector<Bdd> environment(const Bdd &some);
  // Return the states in which the environment has a move that deadlocks the system.
  Bdd stuck_states();
  void join_parts();

  // Return the successors of these states.
  Bdd image(const Bdd &from);

  // Add the states that differ from these only in current values that nothing reads.
  // Such states have the same successors, so they are equivalent in the game.
  Bdd with_equivalent(const Bdd &some);

  // Return whether the specification is realizable if the system wins from these states.
  bool wins_initially(const Bdd &winning, bool robotics_init);

private:
  std::vector<Var> current_vars() const;
  // Relations and relational products of an environment with independent parts.
  struct Parts {
    std::vector<Bdd> moves;      // factors of ENV_TRANS: one per part, then the others
    std::vector<Bdd> answerable; // factors of `answerable`, one per set of next inputs
    std::optional<Product> move; // from states to moves
    std::optional<Product> undo; // from moves to states
    std::optional<Product> step; // from states to next states
  };
  void build_parts(Translation &translate, const Conjuncts &conjuncts, const Environment &environment,
                   const std::vector<Conjunct> &answers);

  // Conjoin ENV_TRANS, factor by factor, to a set of states.
  Bdd environment_moves(const Bdd &from) const;

  // Return the current variables that neither a relation nor a liveness condition reads.
  std::vector<Var> unread_variables();

  std::vector<Bdd> env_factors_; // factors of ENV_TRANS
  std::optional<Parts> parts_;
  std::optional<VarSet> unread_; // the variables returned by unread_variables(), if any
};

// Reachable states.

// Return the states reachable from ENV_INIT & SYS_INIT under the safety constraints of
// both players, and all equivalent states (see Game::with_equivalent).  No play leaves this
// set either, and its diagrams are far smaller if variables only record past events.
Bdd reachable_states(Game &game);

} // namespace slugs
