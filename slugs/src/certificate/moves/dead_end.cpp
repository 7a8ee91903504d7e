// See certificate/moves/dead_end.hpp.

#include "certificate/moves/dead_end.hpp"

#include "certificate/moves/backtracking.hpp"

#include <set>

namespace slugs {

namespace {

std::vector<OpenVariable> joined(std::vector<OpenVariable> inputs, const std::vector<OpenVariable> &outputs) {
  inputs.insert(inputs.end(), outputs.begin(), outputs.end());
  return inputs;
}

} // namespace

DeadEnds::DeadEnds(const Specification &specification, Section env, Section sys,
                   std::vector<OpenVariable> inputs, const std::vector<OpenVariable> &outputs,
                   const Budget &budget)
    : env_(env), sys_(sys), input_count_(static_cast<std::uint32_t>(inputs.size())),
      remainders_(specification, joined(std::move(inputs), outputs), {env, sys}), budget_(budget) {}

DeadEnds::Kind DeadEnds::search(const Assignment &assignment) {
  remainders_.load(assignment);
  std::optional<Remainders::Conjunction> moves = remainders_.remainder(env_, 0);
  if (!moves || !solve(*moves))
    return Kind::EnvironmentStuck;
  const std::optional<Remainders::Conjunction> answers = remainders_.remainder(sys_, 0);
  if (!answers)
    return Kind::SystemStuck;
  FormulaPool &pool = remainders_.pool();
  while (const std::optional<Values> move = solve(*moves)) {
    budget_.check();
    Values values(remainders_.open().size());
    for (std::uint32_t i = 0; i < input_count_; ++i)
      values[i] = (*move)[i].value_or(false);
    const std::optional<Remainders::Conjunction> left = substitute(*answers, values);
    const std::optional<Values> answer = left ? solve(*left) : std::nullopt;
    if (!answer)
      return Kind::SystemStuck;

    // From now on, only moves to which this answer is illegal.
    values.assign(values.size(), std::nullopt);
    for (std::uint32_t i = input_count_; i < values.size(); ++i)
      values[i] = (*answer)[i].value_or(false);
    FormulaId legal = pool.constant(true);
    for (const FormulaId formula : *answers)
      legal = pool.conjunction(legal, remainders_.substitute(formula, values));
    if (legal == pool.constant(true))
      return Kind::None;
    if (legal != pool.constant(false))
      moves->push_back(pool.negation(legal));
  }
  return Kind::None;
}

std::optional<DeadEnds::Values> DeadEnds::solve(const Remainders::Conjunction &formulas) {
  std::set<std::uint32_t> positions;
  for (const FormulaId formula : formulas)
    positions.insert(remainders_.support(formula).begin(), remainders_.support(formula).end());
  std::vector<OpenVariable> variables;
  for (const std::uint32_t position : positions)
    variables.push_back(remainders_.open()[position]);
  const std::vector<std::vector<bool>> found =
      solutions(remainders_.pool(), formulas, variables, remainders_.variable_count(), 1, budget_);
  if (found.empty())
    return std::nullopt;
  Values values(remainders_.open().size());
  std::size_t i = 0;
  for (const std::uint32_t position : positions)
    values[position] = found[0][i++];
  return values;
}

std::optional<Remainders::Conjunction> DeadEnds::substitute(const Remainders::Conjunction &formulas,
                                                            const Values &values) {
  const FormulaPool &pool = remainders_.pool();
  Remainders::Conjunction result;
  for (const FormulaId formula : formulas) {
    const FormulaId left = remainders_.substitute(formula, values);
    if (left == pool.constant(false))
      return std::nullopt;
    if (left != pool.constant(true))
      result.push_back(left);
  }
  return result;
}

} // namespace slugs
