// See certificate/model.hpp.

#include "certificate/model.hpp"

#include "read/messages/diagnostics.hpp"

#include <algorithm>

namespace slugs {

namespace {

std::vector<FormulaId> formulas_of(const Specification &specification,
                                   std::initializer_list<Section> sections) {
  std::vector<FormulaId> formulas;
  for (const Section section : sections)
    for (const Constraint &constraint : specification[section])
      formulas.push_back(constraint.formula);
  return formulas;
}

void set(Truth &truth, unsigned lane, bool value) {
  const LaneBits bit = LaneBits{1} << lane;
  truth.yes = value ? truth.yes | bit : truth.yes & ~bit;
  truth.no = value ? truth.no & ~bit : truth.no | bit;
}

} // namespace

CheckModel::CheckModel(const Specification &specification, const ExplicitStrategy &strategy,
                       const Budget &budget)
    : specification(specification), strategy(strategy), budget(budget) {
  const std::vector<Variable> &variables = specification.variables;
  if (strategy.variables.size() != variables.size())
    throw Rejection("the strategy has " + std::to_string(strategy.variables.size()) +
                    " variables, the specification " + std::to_string(variables.size()));
  for (std::uint32_t i = 0; i < variables.size(); ++i) {
    const Variable &variable = variables[i];
    if (strategy.variables[i] != variable.name)
      throw Rejection("variable " + std::to_string(i) + " of the strategy is '" +
                      printable(strategy.variables[i]) + "', expected '" + printable(variable.name) + "'");
    of_owner_[variable.owner == Owner::Input ? 0 : 1].push_back(i);
  }
  for (Node node = 0; node < strategy.size(); ++node) {
    if (strategy.bit_count[node] != variables.size())
      throw Rejection(name(node) + ": its state has " + std::to_string(strategy.bit_count[node]) +
                      " bits, expected " + std::to_string(variables.size()));
    for (std::uint64_t edge = strategy.first_edge[node]; edge < strategy.first_edge[node + 1]; ++edge)
      if (strategy.successors[edge] == ExplicitStrategy::missing)
        throw Rejection(name(node) + ": its successor " + std::to_string(strategy.named[edge]) +
                        " does not exist");
  }
}

std::vector<CheckModel::Node> CheckModel::initial_nodes() const {
  Evaluation evaluation(specification.formulas,
                        formulas_of(specification, {Section::EnvInit, Section::SysInit}));
  std::vector<Node> initial;
  Assignment assignment = blank();
  for (Node first = 0; first < strategy.size(); first += lanes) {
    budget.check();
    const unsigned count = static_cast<unsigned>(std::min<std::size_t>(lanes, strategy.size() - first));
    for (unsigned lane = 0; lane < count; ++lane)
      put(assignment, first + lane, lane, false);
    evaluation.run(assignment);
    LaneBits good = ~LaneBits{0};
    for (const Section section : {Section::EnvInit, Section::SysInit})
      for (const Constraint &constraint : specification[section]) {
        good &= evaluation[constraint.formula].yes;
        if (first == 0 && !(good & 1))
          throw Rejection(name(0) + ": it should be initial, but violates " + describe(constraint, section));
      }
    for (unsigned lane = 0; lane < count; ++lane)
      if ((good >> lane) & 1)
        initial.push_back(first + lane);
  }
  return initial;
}

void CheckModel::require_reachable(const std::vector<Node> &initial) const {
  std::vector<bool> reached(strategy.size(), false);
  std::vector<Node> open = initial;
  for (const Node node : initial)
    reached[node] = true;
  while (!open.empty()) {
    const Node node = open.back();
    open.pop_back();
    for (std::uint64_t edge = strategy.first_edge[node]; edge < strategy.first_edge[node + 1]; ++edge)
      if (const Node next = strategy.successors[edge]; !reached[next]) {
        reached[next] = true;
        open.push_back(next);
      }
  }
  for (Node node = 0; node < strategy.size(); ++node)
    if (!reached[node])
      throw Rejection(name(node) + ": it is neither initial nor reachable from an initial node");
}

void CheckModel::require_legal_edges() {
  const std::uint64_t edges = strategy.successors.size();
  Evaluation evaluation(specification.formulas,
                        formulas_of(specification, {Section::EnvTrans, Section::SysTrans,
                                                    Section::EnvLiveness, Section::SysLiveness}));
  env_live_edges_.assign(specification[Section::EnvLiveness].size(), std::vector<bool>(edges));
  sys_live_edges_.assign(specification[Section::SysLiveness].size(), std::vector<bool>(edges));
  Assignment assignment = blank();
  Node from[lanes] = {};
  std::uint64_t edge = 0;
  for (Node node = 0; node < strategy.size();) {
    budget.check();
    // Take the next 64 edges, of as many nodes as needed.
    const std::uint64_t first = edge;
    for (; edge - first < lanes && node < strategy.size();) {
      if (edge == strategy.first_edge[node + 1]) {
        ++node;
        continue;
      }
      const unsigned lane = static_cast<unsigned>(edge - first);
      from[lane] = node;
      put(assignment, node, lane, false);
      put(assignment, strategy.successors[edge], lane, true);
      ++edge;
    }
    const unsigned count = static_cast<unsigned>(edge - first);
    if (count == 0)
      break;
    const LaneBits used = count == lanes ? ~LaneBits{0} : (LaneBits{1} << count) - 1;
    evaluation.run(assignment);
    for (const Section section : {Section::EnvTrans, Section::SysTrans})
      for (const Constraint &constraint : specification[section])
        if (const LaneBits bad = evaluation[constraint.formula].no & used; bad != 0) {
          unsigned lane = 0;
          while (!((bad >> lane) & 1))
            ++lane;
          throw Rejection(name(from[lane]) + ": the step to " + name(strategy.successors[first + lane]) +
                          " violates " + describe(constraint, section));
        }
    for (const Section section : {Section::EnvLiveness, Section::SysLiveness}) {
      auto &meeting = section == Section::EnvLiveness ? env_live_edges_ : sys_live_edges_;
      for (std::size_t i = 0; i < meeting.size(); ++i) {
        const LaneBits met = evaluation[specification[section][i].formula].yes;
        for (unsigned lane = 0; lane < count; ++lane)
          meeting[i][first + lane] = (met >> lane) & 1;
      }
    }
  }
}

const std::vector<std::vector<bool>> &CheckModel::edges_meeting(Section liveness) const {
  return liveness == Section::EnvLiveness ? env_live_edges_ : sys_live_edges_;
}

CheckModel::Valuation CheckModel::valuation(Node node, Owner owner) const {
  Valuation result;
  for (const std::uint32_t variable : of_owner_[owner == Owner::Input ? 0 : 1])
    result.push_back(bit(node, variable));
  return result;
}

std::vector<OpenVariable> CheckModel::open_variables(Owner owner, bool next) const {
  std::vector<OpenVariable> result;
  for (const std::uint32_t variable : of_owner_[owner == Owner::Input ? 0 : 1])
    result.push_back({variable, next});
  return result;
}

std::uint64_t CheckModel::largest_degree() const {
  std::uint64_t largest = 0;
  for (Node node = 0; node < strategy.size(); ++node)
    largest = std::max(largest, strategy.first_edge[node + 1] - strategy.first_edge[node]);
  return largest;
}

void CheckModel::put(Assignment &assignment, Node node, unsigned lane, bool next) const {
  std::vector<Truth> &values = next ? assignment.next : assignment.current;
  for (std::uint32_t variable = 0; variable < values.size(); ++variable)
    set(values[variable], lane, bit(node, variable));
}

void CheckModel::put(Assignment &assignment, const Valuation &valuation, Owner owner, unsigned lane,
                     bool next) const {
  const std::vector<std::uint32_t> &variables = of_owner_[owner == Owner::Input ? 0 : 1];
  for (std::size_t i = 0; i < variables.size(); ++i)
    set((next ? assignment.next : assignment.current)[variables[i]], lane, valuation[i]);
}

std::string CheckModel::name(Node node) const { return "node " + std::to_string(strategy.ids[node]); }

// Integers are given by value, bits of no integer by name.
std::string CheckModel::describe(const Valuation &valuation, Owner owner) const {
  const std::vector<std::uint32_t> &variables = of_owner_[owner == Owner::Input ? 0 : 1];
  std::string text;
  const auto add = [&](const std::string &name, std::int64_t value) {
    text += (text.empty() ? "" : ", ") + printable(name) + "=" + std::to_string(value);
  };
  std::vector<std::uint32_t> at(specification.variables.size());
  std::vector<bool> in_integer(specification.variables.size());
  for (std::uint32_t i = 0; i < variables.size(); ++i)
    at[variables[i]] = i;
  for (const Integer &integer : specification.integers) {
    std::int64_t value = integer.min;
    for (std::uint32_t k = 0; k < integer.bits; ++k) {
      in_integer[integer.first + k] = true;
      if (integer.owner == owner && valuation[at[integer.first + k]])
        value += std::int64_t{1} << k;
    }
    if (integer.owner == owner)
      add(integer.name, value);
  }
  for (const std::uint32_t variable : variables)
    if (!in_integer[variable])
      add(specification.variables[variable].name, valuation[at[variable]] ? 1 : 0);
  return text.empty() ? "(there are no variables)" : text;
}

std::string CheckModel::describe(const Constraint &constraint, Section section) const {
  return std::string(section_names[static_cast<std::size_t>(section)]) +
         (constraint.range_limit ? ", the range declared in line " : ", line ") +
         std::to_string(constraint.line) + ": " + printable(specification.text(constraint), 200);
}

} // namespace slugs
