// A function put aside.
//
// The fixpoints keep one set of states for each round of each goal, for later.
// As diagrams in the store these would outweigh what is being worked on: every
// collection would mark them, and sifting would find an order that suits them
// and not the relations.  Outside they are lists of nodes that any later order
// can read back.

#pragma once

#include "bdd/bdd.hpp"

namespace slugs {

class FrozenBdd {
public:
  FrozenBdd(BddStore &store, const Bdd &f);
  Bdd thaw(BddStore &store) const;
  std::size_t size() const { return nodes_.size(); }
  // Its value where value_of(variable) says that of each variable.
  template <typename Values> bool evaluate(const Values &value_of) const {
    Edge e = root_;
    while (e > 1) {
      const Node &node = nodes_[(e >> 1) - 1];
      e = (value_of(node.var) ? node.high : node.low) ^ (e & 1);
    }
    return e == bdd_true;
  }

private:
  struct Node {
    Var var;
    Edge low, high; // positions in nodes_, from 1, as indices of edges; 0 is the constant
  };
  CountedArray<Node> nodes_; // operands first
  Edge root_ = bdd_false;
};

} // namespace slugs
