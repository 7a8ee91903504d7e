// From formulas to the relations of the game, and one step forwards.

#include "game/game.hpp"

#include "game/order.hpp"

#include <algorithm>
#include <cassert>
#include <unordered_map>
#include <unordered_set>

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
// operands first, and not by recursion.  What has been used for the last time is
// dropped: it would be dragged along in collections and reorderings.
Bdd translate(BddStore &store, const FormulaPool &formulas, FormulaId root) {
  struct Value {
    Bdd bdd;
    std::size_t uses = 0; // to come
  };
  std::unordered_map<FormulaId, Value> values;
  std::vector<FormulaId> needed{root};
  const auto use = [&](FormulaId id) {
    if (++values[id].uses == 1)
      needed.push_back(id);
  };
  values[root].uses = 1;
  for (std::size_t i = 0; i < needed.size(); ++i) {
    const FormulaNode node = formulas[needed[i]];
    if (node.op == Op::False || node.op == Op::True || node.op == Op::Variable)
      continue;
    use(node.left);
    if (node.op != Op::Not)
      use(node.right);
  }
  std::sort(needed.begin(), needed.end());
  const auto take = [&](FormulaId id) {
    Value &value = values[id];
    assert(value.uses > 0);
    const Bdd result = value.bdd;
    if (--value.uses == 0)
      value.bdd = Bdd();
    return result;
  };
  for (const FormulaId id : needed) {
    const FormulaNode &node = formulas[id];
    Bdd &result = values[id].bdd;
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
      result = !take(node.left);
      break;
    case Op::And:
      result = take(node.left) & take(node.right);
      break;
    case Op::Or:
      result = take(node.left) | take(node.right);
      break;
    case Op::Xor:
      result = take(node.left) ^ take(node.right);
      break;
    }
  }
  return take(root);
}

std::vector<FormulaId> parts_of(const Specification &specification, FormulaPool &formulas, Section section) {
  std::vector<FormulaId> parts;
  std::unordered_set<FormulaId> known;
  for (const Constraint &constraint : specification[section])
    for (const FormulaId f : conjuncts(formulas, constraint.formula))
      if (known.insert(f).second)
        parts.push_back(f);
  return parts;
}

// Whose conjunction is that of the parts: a new one whenever the last is found to
// have more than `most` nodes.
std::vector<Bdd> factors(BddStore &store, FormulaPool &formulas, std::vector<FormulaId> parts,
                         std::size_t most = static_cast<std::size_t>(-1)) {
  // A conjunction visits what is above its operands, so where there are very many
  // the lowest come first.
  constexpr std::size_t many = 1000;
  if (parts.size() > many) {
    std::unordered_map<FormulaId, std::uint32_t> top;
    for (const FormulaId f : parts)
      for (const std::uint32_t v : variables_of(formulas, f)) {
        const std::uint32_t level = store.level_of(current_var(v));
        const auto [place, fresh] = top.try_emplace(f, level);
        if (!fresh)
          place->second = std::min(place->second, level);
      }
    std::stable_sort(parts.begin(), parts.end(), [&](FormulaId f, FormulaId g) { return top[f] > top[g]; });
  }
  // Sizes cost a visit of the diagram.
  constexpr std::size_t between_looks = 32;
  std::vector<Bdd> result{store.constant(true)};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i % between_looks == 0 && store.live_nodes() > most && store.size(result.back()) > most)
      result.push_back(store.constant(true));
    result.back() &= translate(store, formulas, parts[i]);
  }
  return result;
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
      reordering(store), current_inputs(store.make_set(vars_of(spec, false, true, false))),
      current_outputs(store.make_set(vars_of(spec, false, false, true))),
      current(store.make_set(vars_of(spec, false, true, true))),
      next_inputs(store.make_set(vars_of(spec, true, true, false))),
      next_outputs(store.make_set(vars_of(spec, true, false, true))),
      next(store.make_set(vars_of(spec, true, true, true))), env_init(store.constant(true)),
      sys_init(store.constant(true)), env_trans(store.constant(true)), answerable(store.constant(true)),
      sys_trans(store.constant(true)), states(store.constant(true)) {}

void Game::build() {
  // Each factor costs a multiplication for each set of states.
  constexpr std::size_t most_nodes_of_factor = 10000;
  FormulaPool formulas = specification.formulas;
  const auto conjunction = [&](const std::vector<FormulaId> &parts) {
    return factors(store, formulas, parts).back();
  };
  env_init = conjunction(parts_of(specification, formulas, Section::EnvInit));
  sys_init = conjunction(parts_of(specification, formulas, Section::SysInit));
  env_factors_ =
      factors(store, formulas, parts_of(specification, formulas, Section::EnvTrans), most_nodes_of_factor);
  std::vector<FormulaId> answers = parts_of(specification, formulas, Section::SysTrans);
  const auto of_outputs = std::stable_partition(answers.begin(), answers.end(), [&](FormulaId f) {
    return !mentions(formulas, f, [&](const FormulaNode &variable) {
      return variable.right && specification.variables[variable.left].owner == Owner::Output;
    });
  });
  answerable = conjunction({answers.begin(), of_outputs});
  sys_trans = conjunction({of_outputs, answers.end()});
  assumptions = goals(store, specification, Section::EnvLiveness);
  guarantees = goals(store, specification, Section::SysLiveness);
  const std::vector<Var> nobody_reads = unread();
  if (!nobody_reads.empty())
    unread_ = store.make_set(nobody_reads);
}

std::vector<Var> Game::unread() {
  std::vector<bool> read(2 * specification.variables.size(), false);
  for (const std::vector<Bdd> &readers : {env_factors_, {answerable, sys_trans}, assumptions, guarantees})
    for (const Bdd &reader : readers)
      for (const Var v : store.support(reader))
        read[v] = true;
  std::vector<Var> result = current_vars();
  result.erase(std::remove_if(result.begin(), result.end(), [&](Var v) { return read[v]; }), result.end());
  return result;
}

Bdd Game::environment_moves(const Bdd &from) const {
  Bdd moves = from;
  for (const Bdd &factor : env_factors_)
    moves &= factor;
  return moves;
}

void Game::restrict_to(const Bdd &some) {
  assert(!env_factors_.empty());
  states = some;
  env_trans = environment_moves(some);
  env_factors_.clear();
}

Bdd Game::image(const Bdd &from) {
  assert(!env_factors_.empty());
  return store.to_current(store.exists_both(environment_moves(from) & answerable, sys_trans, current));
}

Bdd Game::with_alike(const Bdd &some) { return unread_ ? store.exists(some, *unread_) : some; }

bool Game::wins_initially(const Bdd &winning, bool robotics_init) {
  if (robotics_init)
    return (env_init & sys_init & !winning).is_false();
  return (env_init & !store.exists_both(sys_init, winning, current_outputs)).is_false();
}

std::vector<Var> Game::current_vars() const { return vars_of(specification, false, true, true); }

} // namespace slugs
