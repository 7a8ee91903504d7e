// Construction of the relations from the formulas, and steps of the game.

#include "game/game.hpp"

#include <algorithm>
#include <cassert>
#include <map>
#include <numeric>

namespace slugs {

Translation::Translation(BddStore &store, const FormulaPool &formulas)
    : store_(store), formulas_(formulas), pacer_(store.account().budget()), uses_(formulas.size(), 0),
      place_(formulas.size(), 0) {}

Bdd Translation::take(FormulaId id) {
  const FormulaNode &node = formulas_[id];
  switch (node.op) {
  case Op::False:
    return store_.constant(false);
  case Op::True:
    return store_.constant(true);
  case Op::Variable:
    return store_.variable(node.right ? next_var(node.left) : current_var(node.left));
  default:
    break;
  }
  assert(uses_[id] > 0 && place_[id] < values_.size());
  Bdd &value = values_[place_[id]];
  const Bdd result = value;
  if (--uses_[id] == 0) {
    value = Bdd();
    free_places_.push_back(place_[id]);
  }
  return result;
}

void Translation::keep(FormulaId id, const Bdd &value) {
  if (free_places_.empty()) {
    free_places_.push_back(static_cast<std::uint32_t>(values_.size()));
    values_.emplace_back();
  }
  assert(is_operator(id) && free_places_.back() < values_.size());
  place_[id] = free_places_.back();
  free_places_.pop_back();
  values_[place_[id]] = value;
}

// Sort operators after their operands.  If they are a large share of their id range,
// scan the range instead of sorting.
void Translation::bring_into_order(std::vector<FormulaId> &needed) {
  if (needed.empty())
    return;
  const auto [low, high] = std::minmax_element(needed.begin(), needed.end());
  const FormulaId first = *low, last = *high;
  assert(is_operator(first) && first <= last);
  if ((last - first) / store_.tuning().scan_share > needed.size()) {
    std::sort(needed.begin(), needed.end());
    return;
  }
  needed.clear();
  for (FormulaId id = first; id <= last; ++id) {
    pacer_.step();
    if (uses_[id] > 0)
      needed.push_back(id);
  }
}

Bdd Translation::operator()(FormulaId root) {
  std::vector<FormulaId> needed;
  const auto use = [&](FormulaId id) {
    if (is_operator(id) && ++uses_[id] == 1)
      needed.push_back(id);
  };
  use(root);
  for (std::size_t i = 0; i < needed.size(); ++i) {
    pacer_.step();
    const FormulaNode &node = formulas_[needed[i]];
    use(node.left);
    if (node.op != Op::Not)
      use(node.right);
  }
  bring_into_order(needed);
  for (const FormulaId id : needed) {
    pacer_.step();
    const FormulaNode &node = formulas_[id];
    assert(node.left < id && (node.op == Op::Not || node.right < id)); // operands come first
    const Bdd left = take(node.left);
    keep(id, node.op == Op::Not   ? !left
             : node.op == Op::And ? left & take(node.right)
             : node.op == Op::Or  ? left | take(node.right)
                                  : left ^ take(node.right));
  }
  assert(needed.empty() || needed.back() == root);
  const Bdd result = take(root);
  assert(free_places_.size() == values_.size()); // nothing is kept
  return result;
}

Product::Product(BddStore &store, const std::vector<Bdd> &relations, const std::vector<Var> &quantified)
    : store_(store) {
  std::vector<Var> left = quantified;
  for (std::size_t i = relations.size(); i-- > 0;) {
    const std::vector<Var> support = store.support(relations[i]);
    const auto reads = [&](Var v) { return std::binary_search(support.begin(), support.end(), v); };
    const auto dropped = std::partition(left.begin(), left.end(), [&](Var v) { return !reads(v); });
    factors_.push_back({relations[i], store.make_set({dropped, left.end()})});
    left.erase(dropped, left.end());
    assert(left.size() <= quantified.size());
  }
  std::reverse(factors_.begin(), factors_.end());
  unread_ = store.make_set(left);
}

Bdd Product::operator()(const Bdd &f) const {
  assert(store_.owns(f));
  Bdd result = store_.exists(f, unread_);
  for (const Factor &factor : factors_)
    result = store_.and_exists(result, factor.relation, factor.dropped);
  return result;
}

namespace {

std::vector<Var> vars_of(const Specification &specification, bool next, bool inputs, bool outputs) {
  std::vector<Var> result;
  for (std::uint32_t i = 0; i < specification.variables.size(); ++i)
    if (specification.variables[i].owner == Owner::Input ? inputs : outputs)
      result.push_back(next ? next_var(i) : current_var(i));
  return result;
}

// Conjoin the parts into factors, and start a new factor when the last one is found to
// have more than `most` nodes.
std::vector<Bdd> factors(BddStore &store, Translation &translate, const Conjuncts &conjuncts,
                         const std::vector<Conjunct> &parts,
                         std::size_t most = static_cast<std::size_t>(-1)) {
  // A conjunction traverses all levels above its second operand, so very many parts are
  // conjoined bottom up.
  assert(most > 0);
  std::vector<std::uint32_t> order(parts.size());
  std::iota(order.begin(), order.end(), 0u);
  if (parts.size() > store.tuning().bottom_up) {
    std::vector<std::uint32_t> top;
    for (const Conjunct &part : parts) {
      const Conjuncts::Reads reads = conjuncts.reads(part);
      std::uint32_t level = reads.begin() == reads.end() ? 0 : static_cast<std::uint32_t>(-1);
      for (const Read read : reads)
        level = std::min(level, store.level_of(current_var(read.variable)));
      top.push_back(level);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t f, std::uint32_t g) { return top[f] > top[g]; });
  }
  // Computing a size traverses the diagram.
  std::vector<Bdd> result{store.constant(true)};
  for (std::size_t i = 0; i < parts.size() && !result.back().is_false(); ++i) {
    if (i % store.tuning().factor_looks == 0 && store.live_nodes() > most && store.size(result.back()) > most)
      result.push_back(store.constant(true));
    const Conjunct &part = parts[order[i]];
    const Bdd value = translate(part.formula);
    result.back() &= part.negative ? !value : value;
  }
  return result;
}

std::vector<Bdd> goals(BddStore &store, Translation &translate, const std::vector<Constraint> &section) {
  std::vector<Bdd> result;
  for (const Constraint &constraint : section)
    result.push_back(translate(constraint.formula));
  if (result.empty())
    result.push_back(store.constant(true));
  assert(!result.empty());
  return result;
}

// Return whether f depends only on variables of these kinds; for assertions.
[[maybe_unused]] bool reads_only(const Game &game, const Bdd &f, bool outputs, bool next_inputs,
                                 bool next_outputs) {
  const std::vector<Var> support = const_cast<BddStore &>(game.store).support(f);
  return std::all_of(support.begin(), support.end(), [&](Var v) {
    const bool input = game.specification.variables[v / 2].owner == Owner::Input;
    return v % 2 ? (input ? next_inputs : next_outputs) : (input || outputs);
  });
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

void Game::build(const Conjuncts &conjuncts, const Environment &environment) {
  // Each factor costs one conjunction per set of states.
  Translation translate(store, specification.formulas);
  const auto conjunction = [&](const std::vector<Conjunct> &parts) {
    return factors(store, translate, conjuncts, parts).back();
  };
  env_init = conjunction(conjuncts[Section::EnvInit]);
  sys_init = conjunction(conjuncts[Section::SysInit]);
  std::vector<Conjunct> answers = conjuncts[Section::SysTrans];
  const auto of_outputs = std::stable_partition(answers.begin(), answers.end(), [&](const Conjunct &f) {
    const Conjuncts::Reads reads = conjuncts.reads(f);
    return std::none_of(reads.begin(), reads.end(), [&](Read read) {
      return read.next && specification.variables[read.variable].owner == Owner::Output;
    });
  });
  env_factors_ = factors(store, translate, conjuncts, environment.shared, store.tuning().factor_nodes);
  if (environment.parts.empty())
    answerable = conjunction({answers.begin(), of_outputs});
  sys_trans = conjunction({of_outputs, answers.end()});
  if (!environment.parts.empty())
    build_parts(translate, conjuncts, environment, {answers.begin(), of_outputs});
  assumptions = goals(store, translate, specification[Section::EnvLiveness]);
  guarantees = goals(store, translate, specification[Section::SysLiveness]);
  assert(!assumptions.empty() && !guarantees.empty());
  assert(reads_only(*this, env_init, false, false, false));
  assert(reads_only(*this, sys_init, true, false, false));
  for ([[maybe_unused]] const Bdd &factor : env_factors_)
    assert(reads_only(*this, factor, true, true, false));
  assert(parts_ || reads_only(*this, answerable, true, true, false));
  const std::vector<Var> unread = unread_variables();
  if (!unread.empty())
    unread_ = store.make_set(unread);
}

void Game::build_parts(Translation &translate, const Conjuncts &conjuncts, const Environment &environment,
                       const std::vector<Conjunct> &answers) {
  const auto conjunction = [&](const std::vector<Conjunct> &constraints) {
    return factors(store, translate, conjuncts, constraints).back();
  };
  parts_.emplace();
  std::vector<Var> own;
  for (const IndependentPart &part : environment.parts) {
    parts_->moves.push_back(conjunction(part.constraints));
    for (const std::uint32_t v : part.own)
      own.push_back(current_var(v));
  }
  parts_->moves.insert(parts_->moves.end(), env_factors_.begin(), env_factors_.end());
  env_factors_.clear();
  std::map<std::vector<std::uint32_t>, std::vector<Conjunct>> by_next_inputs; // keyed by next inputs
  for (const Conjunct &f : answers) {
    std::vector<std::uint32_t> inputs;
    for (const Read read : conjuncts.reads(f))
      if (read.next)
        inputs.push_back(read.variable);
    std::sort(inputs.begin(), inputs.end());
    by_next_inputs[inputs].push_back(f);
  }
  for (const auto &[inputs, constraints] : by_next_inputs)
    parts_->answerable.push_back(conjunction(constraints));

  const std::vector<Bdd> &moves = parts_->moves;
  assert(environment.parts.size() > 1 && moves.size() > environment.parts.size() - 1);
  for ([[maybe_unused]] const Bdd &move : moves)
    assert(reads_only(*this, move, true, true, false));
  for ([[maybe_unused]] const Bdd &part : parts_->answerable)
    assert(reads_only(*this, part, true, true, false));
  parts_->move.emplace(store, moves, own);
  // Shared constraints first: they are often functional, which makes sets smaller.
  parts_->undo.emplace(store, std::vector<Bdd>(moves.rbegin(), moves.rend()),
                       vars_of(specification, true, true, false));
  std::vector<Bdd> all = moves;
  all.insert(all.end(), parts_->answerable.begin(), parts_->answerable.end());
  all.push_back(sys_trans);
  assert(all.size() == moves.size() + parts_->answerable.size() + 1);
  parts_->step.emplace(store, all, current_vars());
}

std::vector<Var> Game::unread_variables() {
  std::vector<bool> read(2 * specification.variables.size(), false);
  std::vector<std::vector<Bdd>> relations{env_factors_, {answerable, sys_trans}, assumptions, guarantees};
  if (parts_)
    relations.insert(relations.end(), {parts_->moves, parts_->answerable});
  for (const std::vector<Bdd> &readers : relations)
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
  assert(reads_only(*this, some, true, false, false));
  states = some;
  if (parts_)
    return;
  assert(!env_factors_.empty());
  env_trans = environment_moves(some);
  assert(store.implies(env_trans, some));
  env_factors_.clear();
}

void Game::join_parts() {
  if (!parts_)
    return;
  env_trans = states;
  for (const Bdd &moves : parts_->moves)
    env_trans &= moves;
  for (const Bdd &part : parts_->answerable)
    answerable &= part;
  parts_.reset();
  assert(reads_only(*this, env_trans, true, true, false) && store.implies(env_trans, states));
}

Bdd Game::moves_from(const Bdd &some) {
  assert(env_factors_.empty() || parts_); // after restrict_to()
  return parts_ ? (*parts_->move)(some) : env_trans & some;
}

std::vector<Bdd> Game::environment(const Bdd &some) {
  return parts_ ? parts_->moves : std::vector<Bdd>{env_trans & some};
}

Bdd Game::sources(const Bdd &moves) {
  assert(reads_only(*this, moves, true, true, false));
  const Bdd result = parts_ ? (*parts_->undo)(moves) : store.exists(moves, next_inputs);
  assert(reads_only(*this, result, true, false, false));
  return result;
}

Bdd Game::sources(const Bdd &moves, const Bdd &allowed) {
  return parts_ ? sources(moves & allowed) : store.and_exists(moves, allowed, next_inputs);
}

Bdd Game::stuck_states() {
  if (!parts_)
    return sources(env_trans & !answerable);
  const Bdd moves = moves_from(states);
  Bdd stuck = store.constant(false);
  for (const Bdd &part : parts_->answerable)
    stuck |= sources(moves & !part);
  return stuck;
}

Bdd Game::image(const Bdd &from) {
  assert(reads_only(*this, from, true, false, false));
  if (parts_)
    return store.to_current((*parts_->step)(from));
  assert(!env_factors_.empty());
  return store.to_current(store.and_exists(environment_moves(from) & answerable, sys_trans, current));
}

Bdd Game::with_equivalent(const Bdd &some) {
  const Bdd result = unread_ ? store.exists(some, *unread_) : some;
  assert(store.implies(some, result));
  return result;
}

bool Game::wins_initially(const Bdd &winning, bool robotics_init) {
  assert(reads_only(*this, winning, true, false, false));
  if (robotics_init)
    return (env_init & sys_init & !winning).is_false();
  return (env_init & !store.and_exists(sys_init, winning, current_outputs)).is_false();
}

std::vector<Var> Game::current_vars() const { return vars_of(specification, false, true, true); }

// Breadth-first symbolic reachability (Burch, Clarke, McMillan, Dill and Hwang
// 1992).  Plays never leave the result, so the fixpoints of the game restricted to it
// agree there with those of the entire game.

Bdd reachable_states(Game &game) {
  Bdd reached = game.with_equivalent(game.env_init & game.sys_init);
  Bdd frontier = reached;
  while (!frontier.is_false()) {
    const Bdd image = game.with_equivalent(game.image(frontier));
    frontier = image & !reached;
    reached |= image;
  }
  assert(game.store.implies(game.image(reached), reached)); // closed
  assert(game.store.implies(game.env_init & game.sys_init, reached));
  return reached;
}

} // namespace slugs
