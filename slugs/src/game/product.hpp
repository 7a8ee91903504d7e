// Relational products of a set with many relations: exists V. f & r_1 & ... & r_n.
//
// One relation after the other is multiplied, and each variable is quantified as
// soon as no later relation reads it ("early quantification": Burch, Clarke and
// Long 1991).  So no intermediate result has more than one relation's past and
// future, which is all the difference where the relations are independent.

#pragma once

#include "bdd/bdd.hpp"

#include <vector>

namespace slugs {

class Product {
public:
  // In the order in which the relations are to be multiplied.
  Product(BddStore &store, const std::vector<Bdd> &relations, const std::vector<Var> &quantified);
  Bdd operator()(const Bdd &f) const;

private:
  struct Factor {
    Bdd relation;
    VarSet dropped; // read by none of those that follow
  };

  BddStore &store_;
  VarSet unread_; // by any relation
  std::vector<Factor> factors_;
};

} // namespace slugs
