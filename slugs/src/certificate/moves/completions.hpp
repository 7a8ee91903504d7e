// All ways to complete a partial valuation so that given constraints hold: the
// next inputs that ENV_TRANS allows from a state, the outputs that SYS_TRANS
// allows after an input.
//
// Enumerating 2^n valuations for each of 10^5 states is out of the question.
// What remains of the constraints is split into components that share no
// variable, and each component that has not been seen before is solved by
// backtracking.  The answer is the product of the components' solutions; it is
// never multiplied out.

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
  // Solutions of each component are listed up to `limit`, beyond that only
  // known to be more.
  Completions(const Specification &specification, std::vector<Section> sections,
              std::vector<OpenVariable> open, std::uint64_t limit, const Budget &budget);

  // The known variables of up to 64 queries; open ones are ignored.
  void load(Assignment assignment) { remainders_.load(std::move(assignment)); }

  struct Component {
    std::vector<std::uint32_t> positions;     // in the list of open variables
    std::vector<std::vector<bool>> solutions; // values at these positions
  };
  // The answer to one query, as a product.
  struct Answer {
    std::vector<const Component *> factors;
    std::vector<std::uint32_t> unconstrained; // positions
    // Number of completions, or a larger number than the limit if there are
    // more than that.
    std::uint64_t count = 0;
  };
  const Answer &answer(unsigned lane);

  // Completions of an answer one by one, as values of the open variables, until
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
