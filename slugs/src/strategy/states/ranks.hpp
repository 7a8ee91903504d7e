// Advancing the rank of a node, the index of the liveness condition that is pursued.
//
// A transition advances the rank past the consecutive conditions that it meets, starting
// with the present one, by at most one full cycle.  These conditions often depend on
// the state alone.  Otherwise they depend on the cofactors of the conditions by the
// state, and equal cofactors advance the rank equally.

#pragma once

#include "strategy/states/state_cofactor.hpp"

#include <map>
#include <vector>

namespace slugs {

class Ranks {
public:
  Ranks(BddStore &store, StateCofactor &cofactor, const std::vector<Bdd> &conditions);

  // The advance on the transitions from a state: the rank of all successors; or, if they
  // differ, the present rank and the number of the tuple of cofactors.
  struct Step {
    std::uint32_t rank;
    std::uint32_t signature; // 0 if all successors have the same rank
  };
  Step from(const Word *state, std::uint32_t rank);
  // Return the rank of a successor; `step` is the last result of from().
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
