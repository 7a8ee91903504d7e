// The check of a strategy of the system, by the conditions in certificate/check.hpp.

#include "certificate/strategy.hpp"
#include "certificate/graph/cycles.hpp"

#include <unordered_map>
#include <unordered_set>

namespace slugs {

namespace {

using Node = CheckModel::Node;
using Valuation = CheckModel::Valuation;

void require_initial_nodes(const CheckModel &model, const std::vector<Node> &initial) {
  std::unordered_set<Valuation> covered;
  for (const Node node : initial)
    covered.insert(model.valuation(node, Owner::Input));
  Completions inputs(model.specification, {Section::EnvInit}, model.open_variables(Owner::Input, false),
                     covered.size(), model.budget);
  inputs.load(model.blank());
  inputs.enumerate(inputs.answer(0), [&](const Valuation &input) {
    if (covered.count(input) == 0)
      throw Rejection("no initial node for the input that ENV_INIT allows: " +
                      model.describe(input, Owner::Input));
    return true;
  });
}

void require_all_initial_states(const CheckModel &model, const std::vector<Node> &initial) {
  std::unordered_set<Valuation> covered;
  const auto joined = [](Valuation input, const Valuation &output) {
    input.insert(input.end(), output.begin(), output.end());
    return input;
  };
  for (const Node node : initial)
    covered.insert(joined(model.valuation(node, Owner::Input), model.valuation(node, Owner::Output)));
  std::vector<OpenVariable> open = model.open_variables(Owner::Input, false);
  const std::ptrdiff_t inputs = static_cast<std::ptrdiff_t>(open.size());
  for (const OpenVariable &output : model.open_variables(Owner::Output, false))
    open.push_back(output);
  Completions states(model.specification, {Section::EnvInit, Section::SysInit}, open, covered.size(),
                     model.budget);
  states.load(model.blank());
  states.enumerate(states.answer(0), [&](const Valuation &state) {
    if (covered.count(state) == 0)
      throw Rejection("no node for the initial state " +
                      model.describe(Valuation(state.begin(), state.begin() + inputs), Owner::Input) + ", " +
                      model.describe(Valuation(state.begin() + inputs, state.end()), Owner::Output));
    return true;
  });
}

// Checks that every node has one successor for each next input.  All edges are
// known to be legal, so it suffices that the inputs differ and that their
// number is right.
class SuccessorCheck {
public:
  explicit SuccessorCheck(const CheckModel &model)
      : model_(model), graph_(model.strategy),
        allowed_(model.specification, {Section::EnvTrans}, model.open_variables(Owner::Input, true),
                 model.largest_degree(), model.budget) {
    std::unordered_map<Valuation, std::uint32_t> numbers;
    for (Node node = 0; node < graph_.size(); ++node)
      input_.push_back(
          numbers.emplace(model.valuation(node, Owner::Input), static_cast<std::uint32_t>(numbers.size()))
              .first->second);
    last_node_.assign(numbers.size(), ExplicitStrategy::missing);
    last_successor_.resize(numbers.size());
  }

  void run() {
    Assignment assignment = model_.blank();
    for (Node first = 0; first < graph_.size(); first += lanes) {
      model_.budget.check();
      const Node count = static_cast<Node>(std::min<std::size_t>(lanes, graph_.size() - first));
      for (Node i = 0; i < count; ++i)
        model_.put(assignment, first + i, i, false);
      allowed_.load(assignment);
      for (Node i = 0; i < count; ++i) {
        require_different_inputs(first + i);
        const Completions::Answer &answer = allowed_.answer(i);
        if (answer.count != graph_.first_edge[first + i + 1] - graph_.first_edge[first + i])
          report_missing(first + i, answer);
      }
    }
  }

private:
  void require_different_inputs(Node node) {
    for (std::uint64_t edge = graph_.first_edge[node]; edge < graph_.first_edge[node + 1]; ++edge) {
      const Node successor = graph_.successors[edge];
      const std::uint32_t input = input_[successor];
      if (last_node_[input] == node)
        throw Rejection(model_.name(node) + ": its successors " +
                        std::to_string(graph_.ids[last_successor_[input]]) + " and " +
                        std::to_string(graph_.ids[successor]) + " answer the same next input, " +
                        model_.describe(model_.valuation(successor, Owner::Input), Owner::Input));
      last_node_[input] = node;
      last_successor_[input] = successor;
    }
  }

  void report_missing(Node node, const Completions::Answer &answer) const {
    std::unordered_set<Valuation> answered;
    for (std::uint64_t edge = graph_.first_edge[node]; edge < graph_.first_edge[node + 1]; ++edge)
      answered.insert(model_.valuation(graph_.successors[edge], Owner::Input));
    allowed_.enumerate(answer, [&](const Valuation &input) {
      if (answered.count(input) == 0)
        throw Rejection(model_.name(node) + ": no successor for the next input that ENV_TRANS allows: " +
                        model_.describe(input, Owner::Input));
      return true;
    });
    throw std::logic_error("successors and allowed inputs do not match, but none is missing");
  }

  const CheckModel &model_;
  const ExplicitStrategy &graph_;
  Completions allowed_;
  std::vector<std::uint32_t> input_; // number of each node's input valuation
  std::vector<Node> last_node_;      // that answered each input
  std::vector<Node> last_successor_; // with which successor
};

// Requires for each guarantee that the edges that do not meet it have no
// component in which every assumption is met.
void require_guarantees(const CheckModel &model) {
  const ExplicitStrategy &graph = model.strategy;
  const auto &assumptions = model.edges_meeting(Section::EnvLiveness);
  const auto &guarantees = model.edges_meeting(Section::SysLiveness);
  for (std::size_t j = 0; j < guarantees.size(); ++j) {
    model.budget.check();
    std::vector<bool> kept = guarantees[j];
    kept.flip();
    std::uint32_t count;
    const std::vector<std::uint32_t> component = components(graph, kept, count);
    std::vector<std::size_t> met(count, 0); // assumptions 0 .. met-1 so far
    std::vector<bool> cyclic(count, false);
    for (std::size_t i = 0; i <= assumptions.size(); ++i) {
      std::vector<bool> now(count, false);
      for (Node node = 0; node < graph.size(); ++node)
        for (std::uint64_t edge = graph.first_edge[node]; edge < graph.first_edge[node + 1]; ++edge)
          if (kept[edge] && component[graph.successors[edge]] == component[node]) {
            cyclic[component[node]] = true;
            if (i < assumptions.size() && assumptions[i][edge])
              now[component[node]] = true;
          }
      for (std::uint32_t c = 0; c < count; ++c)
        if (now[c] && met[c] == i)
          ++met[c];
    }
    for (Node node = 0; node < graph.size(); ++node)
      if (cyclic[component[node]] && met[component[node]] == assumptions.size())
        throw Rejection(model.name(node) +
                        ": it is on a cycle that meets all assumptions but never the guarantee " +
                        model.describe(model.specification[Section::SysLiveness][j], Section::SysLiveness));
  }
}

} // namespace

void check_strategy(CheckModel &model, bool robotics_init) {
  const std::vector<Node> initial = model.initial_nodes();
  if (robotics_init)
    require_all_initial_states(model, initial);
  else
    require_initial_nodes(model, initial);
  model.require_legal_edges();
  SuccessorCheck(model).run();
  model.require_reachable(initial);
  require_guarantees(model);
}

} // namespace slugs
