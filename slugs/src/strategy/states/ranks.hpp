// How the rank of a node, the liveness condition being pursued, advances.
//
// On a transition the rank moves past every condition that this transition
// satisfies, from the present one on, at most once around.  Which they are
// often depends on the state alone; otherwise the conditions' cofactors by the
// state decide, and equal cofactors advance equally.

#pragma once

#include "strategy/states/state_cofactor.hpp"

#include <map>
#include <vector>

namespace slugs {

class Ranks {
public:
  Ranks(BddStore &store, StateCofactor &cofactor, const std::vector<Bdd> &conditions);

  // For the transitions from a state: the rank of all successors, or the
  // present one if they differ, with a number that names how.
  struct Step {
    std::uint32_t rank;
    std::uint32_t signature; // 0 if all successors have the same rank
  };
  Step from(const Word *state, std::uint32_t rank);
  // The rank of a successor, for the step that was asked for last.
  std::uint32_t advance(const Step &step, const Word *next) const;

  void forget() { signatures_.clear(); }

private:
  const Operations &edges_;
  StateCofactor &cofactor_;
  std::vector<Bdd> conditions_;
  std::vector<Edge> cofactors_;
  std::map<std::vector<Edge>, std::uint32_t> signatures_;
};

} // namespace slugs
