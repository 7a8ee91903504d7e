// From formulas to the relations of the game, and one step forwards.

#include "game/game.hpp"

#include "game/order.hpp"

#include <algorithm>
#include <unordered_map>

namespace slugs {

namespace {

std::vector<Var> vars_of(const Specification &specification, bool next, bool inputs, bool outputs) {
  std::vector<Var> result;
  for (std::uint32_t i = 0; i < specification.variables.size(); ++i)
    if (specification.variables[i].owner == Owner::Input ? inputs : outputs)
      result.push_back(next ? next_var(i) : current_var(i));
  return result;
}

// Formulas may be deep, so they are translated in the order of their ids,
// operands first, and not by recursion.
Bdd translate(BddStore &store, const FormulaPool &formulas, FormulaId root) {
  std::unordered_map<FormulaId, Bdd> done;
  std::vector<FormulaId> needed{root};
  done.emplace(root, Bdd());
  for (std::size_t i = 0; i < needed.size(); ++i) {
    const FormulaNode &node = formulas[needed[i]];
    if (node.op == Op::False || node.op == Op::True || node.op == Op::Variable)
      continue;
    if (done.try_emplace(node.left).second)
      needed.push_back(node.left);
    if (node.op != Op::Not && done.try_emplace(node.right).second)
      needed.push_back(node.right);
  }
  std::sort(needed.begin(), needed.end());
  for (const FormulaId id : needed) {
    const FormulaNode &node = formulas[id];
    Bdd &result = done[id];
    switch (node.op) {
    case Op::False:
      result = store.constant(false);
      break;
    case Op::True:
      result = store.constant(true);
      break;
    case Op::Variable:
      result = store.variable(node.right ? next_var(node.left) : current_var(node.left));
      break;
    case Op::Not:
      result = !done[node.left];
      break;
    case Op::And:
      result = done[node.left] & done[node.right];
      break;
    case Op::Or:
      result = done[node.left] | done[node.right];
      break;
    case Op::Xor:
      result = done[node.left] ^ done[node.right];
      break;
    }
  }
  return done[root];
}

void conjoin(Bdd &result, BddStore &store, const Specification &specification, FormulaPool &formulas,
             Section section, const std::function<void()> &between_steps) {
  for (const Constraint &constraint : specification[section])
    for (const FormulaId f : conjuncts(formulas, constraint.formula)) {
      result &= translate(store, formulas, f);
      between_steps();
    }
}

std::vector<Bdd> goals(BddStore &store, const Specification &specification, Section section) {
  std::vector<Bdd> result;
  for (const Constraint &constraint : specification[section])
    result.push_back(translate(store, specification.formulas, constraint.formula));
  if (result.empty())
    result.push_back(store.constant(true));
  return result;
}

} // namespace

Game::Game(const Specification &spec, const std::vector<std::uint32_t> &order, const Budget &budget)
    : specification(spec), store(static_cast<std::uint32_t>(spec.variables.size()), order, budget),
      current_inputs(store.make_set(vars_of(spec, false, true, false))),
      current_outputs(store.make_set(vars_of(spec, false, false, true))),
      current(store.make_set(vars_of(spec, false, true, true))),
      next_inputs(store.make_set(vars_of(spec, true, true, false))),
      next_outputs(store.make_set(vars_of(spec, true, false, true))),
      next(store.make_set(vars_of(spec, true, true, true))), env_init(store.constant(true)),
      sys_init(store.constant(true)), env_trans(store.constant(true)), sys_trans(store.constant(true)),
      states(store.constant(true)) {}

void Game::build(const std::function<void()> &between_steps) {
  FormulaPool formulas = specification.formulas;
  conjoin(env_init, store, specification, formulas, Section::EnvInit, between_steps);
  conjoin(sys_init, store, specification, formulas, Section::SysInit, between_steps);
  conjoin(env_trans, store, specification, formulas, Section::EnvTrans, between_steps);
  conjoin(sys_trans, store, specification, formulas, Section::SysTrans, between_steps);
  assumptions = goals(store, specification, Section::EnvLiveness);
  guarantees = goals(store, specification, Section::SysLiveness);
}

void Game::restrict_to(const Bdd &some) {
  states = some;
  env_trans &= some;
}

Bdd Game::image(const Bdd &from) {
  return store.to_current(store.exists_both(from & env_trans, sys_trans, current));
}

bool Game::wins_initially(const Bdd &winning, bool robotics_init) {
  if (robotics_init)
    return (env_init & sys_init & !winning).is_false();
  return (env_init & !store.exists_both(sys_init, winning, current_outputs)).is_false();
}

std::vector<Var> Game::current_vars() const { return vars_of(specification, false, true, true); }

} // namespace slugs
