// A function stored outside of the BDD store.
//
// The fixpoints keep one set of states per round and goal for the strategy.  In the
// store these sets would outweigh the relations: every collection would mark them,
// and sifting would optimize the order for them.  As lists of nodes they can be
// rebuilt in any later order.

#pragma once

#include "bdd/bdd.hpp"

namespace slugs {

class FrozenBdd {
public:
  FrozenBdd(BddStore &store, const Bdd &f);
  Bdd thaw(BddStore &store) const;
  std::size_t size() const { return nodes_.size(); }

private:
  struct Node {
    Var var;
    Edge low, high; // edges whose node indices are positions in nodes_, from 1; 0: constant
  };
  CountedArray<Node> nodes_; // children before parents
  Edge root_ = bdd_false;
};

} // namespace slugs
