// Relational product of a set with several relations: exists V. f & r_1 & ... & r_n.
//
// The relations are conjoined in turn, and each variable is quantified as soon as no
// later relation reads it ("early quantification": Burch, Clarke and Long 1991).  So
// an intermediate result relates current and next values of one relation at most,
// which is decisive if the relations are independent.

#pragma once

#include "bdd/bdd.hpp"

#include <vector>

namespace slugs {

class Product {
public:
  // `relations`: in the order of their conjunction.
  Product(BddStore &store, const std::vector<Bdd> &relations, const std::vector<Var> &quantified);
  Bdd operator()(const Bdd &f) const;

private:
  struct Factor {
    Bdd relation;
    VarSet dropped; // quantified variables that no later relation reads
  };

  BddStore &store_;
  VarSet unread_; // quantified variables that no relation reads
  std::vector<Factor> factors_;
};

} // namespace slugs
