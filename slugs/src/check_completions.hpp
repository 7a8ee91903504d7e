// All ways to complete a partial valuation so that given constraints hold: the
// next inputs that ENV_TRANS allows from a state, the outputs that SYS_TRANS
// allows after an input.
//
// Enumerating 2^n valuations for each of 10^5 states is out of the question, so
// each query is answered in three steps.  (1) The constraints are evaluated
// with the open variables unknown, for 64 queries at once; most are decided by
// that.  (2) What remains is rewritten over the open variables alone, in a
// hash-consed pool, so that equal remainders have equal ids, and is split into
// components that share no variable.  (3) Each component that has not been seen
// before is solved by backtracking with three-valued evaluation.  The answer is
// the product of the components' solutions; it is never multiplied out.

#pragma once

#include "budget.hpp"
#include "check_evaluation.hpp"
#include "specification.hpp"

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

namespace slugs {

// A variable that a query leaves open.
struct OpenVariable {
  std::uint32_t index;
  bool next;
};

class Completions {
public:
  // Solutions of each component are listed up to `limit`, beyond that only
  // known to be more.
  Completions(const Specification &specification, const std::vector<Section> &sections,
              std::vector<OpenVariable> open, std::uint64_t limit, const Budget &budget);

  // The known variables of up to 64 queries; open ones are ignored.
  void load(Assignment assignment);

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
  using Remainder = std::vector<FormulaId>; // a conjunction, sorted

  std::optional<Remainder> remainder(unsigned lane);
  FormulaId rewrite(FormulaId root, unsigned lane);
  std::unique_ptr<Answer> compose(const Remainder &remainder);
  const Component &component(const Remainder &remainder);
  const std::vector<std::uint32_t> &support(FormulaId formula);

  FormulaPool pool_; // begins as the specification's, so that ids agree
  std::vector<FormulaId> roots_;
  std::vector<OpenVariable> open_;
  std::uint64_t limit_;
  const Budget &budget_;
  std::vector<bool> only_open_; // formulas of the specification without a known variable
  std::vector<std::array<std::uint32_t, 2>> position_; // of each variable, current and next
  Evaluation evaluation_;
  std::vector<std::uint32_t> slots_; // of the formulas that evaluation_ needs

  std::vector<FormulaId> rewritten_; // of this lane, valid where the stamp is current
  std::vector<std::uint64_t> stamp_;
  std::uint64_t now_ = 0;
  std::map<Remainder, std::unique_ptr<Answer>> answers_;
  std::map<Remainder, std::unique_ptr<Component>> components_;
  std::map<FormulaId, std::vector<std::uint32_t>> supports_;
  Answer none_;
};

} // namespace slugs
