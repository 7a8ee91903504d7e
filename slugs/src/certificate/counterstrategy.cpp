// The check of a counterstrategy of the environment, by the conditions in
// certificate/check.hpp.

#include "certificate/counterstrategy.hpp"
#include "certificate/graph/cycles.hpp"
#include "certificate/moves/dead_end.hpp"

#include <algorithm>
#include <map>
#include <unordered_set>

namespace slugs {

namespace {

using Node = CheckModel::Node;
using Valuation = CheckModel::Valuation;

void require_initial_outputs(const CheckModel &model, const std::vector<Node> &initial) {
  std::map<Valuation, std::unordered_set<Valuation>> outputs_of;
  for (const Node node : initial)
    outputs_of[model.valuation(node, Owner::Input)].insert(model.valuation(node, Owner::Output));
  Completions outputs(model.specification, {Section::SysInit}, model.open_variables(Owner::Output, false),
                      model.strategy.size() + 1, model.budget);
  std::string missing;
  for (const auto &entry : outputs_of) {
    const Valuation &input = entry.first;
    const std::unordered_set<Valuation> &covered = entry.second;
    Assignment assignment = model.blank();
    model.put(assignment, input, Owner::Input, 0, false);
    outputs.load(assignment);
    const Completions::Answer &answer = outputs.answer(0);
    if (answer.count == covered.size())
      return;
    outputs.enumerate(answer, [&](const Valuation &output) {
      if (covered.count(output) != 0)
        return true;
      if (missing.empty())
        missing = ", such as, for the input " + model.describe(input, Owner::Input) + ", the output " +
                  model.describe(output, Owner::Output);
      return false;
    });
  }
  DeadEnds dead_ends(model.specification, Section::EnvInit, Section::SysInit,
                     model.open_variables(Owner::Input, false), model.open_variables(Owner::Output, false),
                     model.budget);
  if (dead_ends.search(model.blank()) != DeadEnds::Kind::SystemStuck)
    throw Rejection("for no input that ENV_INIT allows are all outputs that SYS_INIT allows initial nodes" +
                    missing);
}

class ReplyCheck {
public:
  explicit ReplyCheck(const CheckModel &model)
      : model_(model), graph_(model.strategy),
        dead_ends_(model.specification, Section::EnvTrans, Section::SysTrans,
                   model.open_variables(Owner::Input, true), model.open_variables(Owner::Output, true),
                   model.budget),
        outputs_(model.specification, {Section::SysTrans}, model.open_variables(Owner::Output, true),
                 model.largest_degree(), model.budget) {}

  void run() {
    Assignment assignment = model_.blank();
    Node batch[lanes];
    unsigned count = 0;
    const auto check_batch = [&] {
      model_.budget.check();
      outputs_.load(assignment);
      for (unsigned lane = 0; lane < count; ++lane)
        require_all_outputs(batch[lane], outputs_.answer(lane));
      count = 0;
    };
    for (Node node = 0; node < graph_.size(); ++node) {
      const std::uint64_t first = graph_.first_edge[node];
      if (first == graph_.first_edge[node + 1]) {
        require_dead_end(node);
        continue;
      }
      require_one_input(node);
      model_.put(assignment, node, count, false);
      model_.put(assignment, graph_.successors[first], count, true);
      batch[count++] = node;
      if (count == lanes)
        check_batch();
    }
    if (count > 0)
      check_batch();
  }

private:
  void require_one_input(Node node) const {
    const std::uint64_t first = graph_.first_edge[node];
    const Valuation input = model_.valuation(graph_.successors[first], Owner::Input);
    std::unordered_set<Valuation> outputs;
    for (std::uint64_t edge = first; edge < graph_.first_edge[node + 1]; ++edge) {
      const Node successor = graph_.successors[edge];
      if (model_.valuation(successor, Owner::Input) != input)
        throw Rejection(model_.name(node) + ": its successors " + std::to_string(graph_.named[first]) +
                        " and " + std::to_string(graph_.named[edge]) + " have different inputs");
      if (!outputs.insert(model_.valuation(successor, Owner::Output)).second)
        throw Rejection(model_.name(node) + ": two of its successors have the state of " +
                        model_.name(successor));
    }
  }

  // All successors are legal and differ, so their number decides.
  void require_all_outputs(Node node, const Completions::Answer &answer) const {
    const std::uint64_t first = graph_.first_edge[node];
    if (answer.count == graph_.first_edge[node + 1] - first)
      return;
    std::unordered_set<Valuation> covered;
    for (std::uint64_t edge = first; edge < graph_.first_edge[node + 1]; ++edge)
      covered.insert(model_.valuation(graph_.successors[edge], Owner::Output));
    outputs_.enumerate(answer, [&](const Valuation &output) {
      if (covered.count(output) == 0)
        throw Rejection(model_.name(node) + ": no successor for the output that SYS_TRANS allows: " +
                        model_.describe(output, Owner::Output));
      return true;
    });
    throw std::logic_error("successors and allowed outputs do not match, but none is missing");
  }

  void require_dead_end(Node node) {
    Assignment assignment = model_.blank();
    model_.put(assignment, node, 0, false);
    switch (dead_ends_.search(assignment)) {
    case DeadEnds::Kind::SystemStuck:
      return;
    case DeadEnds::Kind::EnvironmentStuck:
      throw Rejection(model_.name(node) + ": it has no successors, but it is the environment that is stuck");
    case DeadEnds::Kind::None:
      throw Rejection(model_.name(node) +
                      ": it has no successors, but the system has an output for every next "
                      "input that ENV_TRANS allows");
    }
  }

  const CheckModel &model_;
  const ExplicitStrategy &graph_;
  DeadEnds dead_ends_;
  Completions outputs_;
};

// No play may satisfy all guarantees, none may starve an assumption.
void require_violation(const CheckModel &model) {
  const ExplicitStrategy &graph = model.strategy;
  const auto each_inner_edge = [&](const std::vector<std::uint32_t> &component, const std::vector<bool> &kept,
                                   auto visit) {
    for (Node node = 0; node < graph.size(); ++node)
      for (std::uint64_t edge = graph.first_edge[node]; edge < graph.first_edge[node + 1]; ++edge)
        if (kept[edge] && component[graph.successors[edge]] == component[node])
          visit(node, edge);
  };
  std::uint32_t count;
  const std::vector<bool> all(graph.successors.size(), true);
  const std::vector<std::uint32_t> component = components(graph, all, count);
  const auto &guarantees = model.edges_meeting(Section::SysLiveness);
  std::vector<bool> wins(count, false); // has a cycle, and meets all guarantees so far
  each_inner_edge(component, all, [&](Node node, std::uint64_t) { wins[component[node]] = true; });
  for (const std::vector<bool> &meeting : guarantees) {
    model.budget.check();
    std::vector<bool> met(count, false);
    each_inner_edge(component, all, [&](Node node, std::uint64_t edge) {
      if (meeting[edge])
        met[component[node]] = true;
    });
    for (std::uint32_t c = 0; c < count; ++c)
      wins[c] = wins[c] && met[c];
  }
  for (Node node = 0; node < graph.size(); ++node)
    if (wins[component[node]])
      throw Rejection(model.name(node) + ": it is on a cycle that meets all guarantees");

  const auto &assumptions = model.edges_meeting(Section::EnvLiveness);
  for (std::size_t i = 0; i < assumptions.size(); ++i) {
    model.budget.check();
    std::vector<bool> kept = assumptions[i];
    kept.flip();
    const std::vector<std::uint32_t> starving = components(graph, kept, count);
    each_inner_edge(starving, kept, [&](Node node, std::uint64_t) {
      throw Rejection(model.name(node) + ": it is on a cycle that never meets the assumption " +
                      model.describe(model.specification[Section::EnvLiveness][i], Section::EnvLiveness));
    });
  }
}

} // namespace

void check_counterstrategy(CheckModel &model, bool robotics_init) {
  const std::vector<Node> initial = model.initial_nodes();
  if (!robotics_init)
    require_initial_outputs(model, initial);
  else if (initial.empty())
    throw Rejection("there is no initial node");
  model.require_legal_edges();
  ReplyCheck(model).run();
  model.require_reachable(initial);
  require_violation(model);
}

} // namespace slugs
