// A strategy with its specification: the part shared by both checks.
//
// Every error is thrown as a Rejection, whose text names the node.

#pragma once

#include "certificate/graph/strategy_reader.hpp"
#include "certificate/moves/completions.hpp"
#include "certificate/moves/evaluation.hpp"
#include "core/budget.hpp"
#include "core/specification.hpp"

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace slugs {

struct Rejection : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class CheckModel {
public:
  using Node = std::uint32_t;
  using Valuation = std::vector<bool>; // of the variables of one owner

  // Throws Rejection if the variables, the states or the successors do not fit.
  CheckModel(const Specification &specification, const ExplicitStrategy &strategy, const Budget &budget);

  // Nodes whose state satisfies ENV_INIT and SYS_INIT; node 0 must be one.
  std::vector<Node> initial_nodes() const;
  void require_reachable(const std::vector<Node> &initial) const;

  // Every edge must satisfy ENV_TRANS and SYS_TRANS.  Fills in, for each
  // liveness constraint, the edges that meet it.
  void require_legal_edges();
  const std::vector<std::vector<bool>> &edges_meeting(Section liveness) const;

  Valuation valuation(Node node, Owner owner) const;
  std::vector<OpenVariable> open_variables(Owner owner, bool next) const;
  std::uint64_t largest_degree() const;

  // Puts a state on a lane as current or next values.
  void put(Assignment &assignment, Node node, unsigned lane, bool next) const;
  void put(Assignment &assignment, const Valuation &valuation, Owner owner, unsigned lane, bool next) const;
  Assignment blank() const { return Assignment(specification.variables.size()); }

  // For messages.
  std::string name(Node node) const;
  std::string describe(const Valuation &valuation, Owner owner) const;
  std::string describe(const Constraint &constraint, Section section) const;

  const Specification &specification;
  const ExplicitStrategy &strategy;
  const Budget &budget;

private:
  bool bit(Node node, std::uint32_t variable) const {
    return strategy.bits[strategy.first_bit[node] + variable];
  }

  std::vector<std::uint32_t> of_owner_[2];        // variables of each owner in order
  std::vector<std::vector<bool>> env_live_edges_; // for each assumption
  std::vector<std::vector<bool>> sys_live_edges_; // for each guarantee
};

} // namespace slugs
