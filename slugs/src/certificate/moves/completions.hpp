// All completions of a partial valuation that satisfy given constraints: the
// next inputs that ENV_TRANS allows from a state, the outputs that SYS_TRANS
// allows after an input.
//
// Enumerating 2^n valuations for each of 10^5 states is infeasible.  So the
// remainders of the constraints are split into components that share no
// variable, and each new component is solved by backtracking.  The answer is
// the product of the components' solutions, which is never expanded.

#pragma once

#include "certificate/moves/remainders.hpp"
#include "core/budget.hpp"

#include <functional>
#include <map>
#include <memory>
#include <vector>

namespace slugs {

class Completions {
public:
  // At most `limit` solutions of each component are listed; beyond that, it is
  // only known that there are more.
  Completions(const Specification &specification, std::vector<Section> sections,
              std::vector<OpenVariable> open, std::uint64_t limit, const Budget &budget);

  // Set the known variables of up to 64 queries; open ones are ignored.
  void load(Assignment assignment) { remainders_.load(std::move(assignment)); }

  struct Component {
    std::vector<std::uint32_t> positions;     // in the list of open variables
    std::vector<std::vector<bool>> solutions; // values at these positions
  };
  // The answer to one query, as a product.
  struct Answer {
    std::vector<const Component *> factors;
    std::vector<std::uint32_t> unconstrained; // positions
    // Number of completions; if there are more than the limit, any number above
    // it.
    std::uint64_t count = 0;
  };
  const Answer &answer(unsigned lane);

  // Visit the completions of an answer, as values of the open variables, until
  // `visit` returns false.
  void enumerate(const Answer &answer, const std::function<bool(const std::vector<bool> &)> &visit) const;

private:
  using Conjunction = Remainders::Conjunction;

  std::unique_ptr<Answer> compose(const Conjunction &remainder);
  const Component &component(const Conjunction &remainder);

  Remainders remainders_;
  std::vector<Section> sections_;
  std::uint64_t limit_;
  const Budget &budget_;
  std::map<Conjunction, std::unique_ptr<Answer>> answers_;
  std::map<Conjunction, std::unique_ptr<Component>> components_;
  Answer none_;
};

} // namespace slugs
