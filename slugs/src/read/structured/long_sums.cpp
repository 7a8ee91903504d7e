// See read/structured/long_sums.hpp.

#include "read/structured/long_sums.hpp"

#include <algorithm>
#include <cassert>
#include <iterator>
#include <utility>

namespace slugs {

namespace {

constexpr std::size_t short_sum = 12;          // terms up to which adders suffice
constexpr std::size_t most_amounts = 1u << 23; // in total

// A bit or its negation, which adds its weight if it is true.
struct Summand {
  FormulaId literal;
  std::int64_t weight;
};

// A comparison of the sum of the summands with a bound.
struct Bounded {
  std::vector<Summand> summands;
  std::int64_t bound;
};

// a - b against 0, without negative weights: -w b is w !b - w.
Bounded bounded(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b) {
  Bounded result{{}, b.offset - a.offset};
  const auto add = [&](const IntegerValue &value, bool negative) {
    for (const IntegerValue::Term &term : value.terms)
      for (std::size_t bit = 0; bit < term.bits.size(); ++bit) {
        const auto weight = static_cast<std::int64_t>(term.times << bit);
        const FormulaId f = term.bits[bit];
        result.summands.push_back({negative ? pool.negation(f) : f, weight});
        if (negative)
          result.bound += weight;
      }
  };
  add(a, false);
  add(b, true);
  const auto place = [&](const Summand &summand) {
    FormulaNode node = pool[summand.literal];
    if (node.op == Op::Not)
      node = pool[node.left];
    return static_cast<std::uint64_t>(node.left) << 32 | node.right;
  };
  std::stable_sort(result.summands.begin(), result.summands.end(),
                   [&](const Summand &x, const Summand &y) { return place(x) < place(y); });
  return result;
}

class LongSum {
public:
  LongSum(FormulaPool &pool, Bounded sum, bool exactly, BudgetPacer &pacer)
      : pool_(pool), summands_(std::move(sum.summands)), exactly_(exactly), pacer_(pacer),
        rest_(summands_.size() + 1) {
    for (std::size_t i = summands_.size(); i-- > 0;)
      rest_[i] = rest_[i + 1] + summands_[i].weight;
    bound_ = sum.bound;
  }

  std::optional<FormulaId> formula() {
    if (!meet_amounts())
      return std::nullopt;
    // Operands first: from the last summand back.
    std::vector<FormulaId> below;
    for (std::size_t i = summands_.size(); i-- > 0;) {
      std::vector<FormulaId> here;
      here.reserve(left_[i].size());
      for (const std::int64_t left : left_[i]) {
        pacer_.step();
        const FormulaId with = value(i + 1, left - summands_[i].weight, below);
        const FormulaId without = value(i + 1, left, below);
        const FormulaId bit = summands_[i].literal;
        here.push_back(with == without ? with
                                       : pool_.disjunction(pool_.conjunction(bit, with),
                                                           pool_.conjunction(pool_.negation(bit), without)));
      }
      below = std::move(here);
    }
    return value(0, bound_, below);
  }

private:
  // The result, if the rest decides it for all values of the summands from i
  // on.
  std::optional<bool> decided(std::size_t i, std::int64_t left) const {
    if (left < 0)
      return false;
    if (exactly_ && left > rest_[i])
      return false;
    if (exactly_ ? rest_[i] == 0 : left >= rest_[i])
      return true;
    return std::nullopt;
  }

  // Compute the possible rests of the bound before each summand, ascending.
  bool meet_amounts() {
    std::size_t amounts = 0;
    std::vector<std::int64_t> here{bound_};
    for (std::size_t i = 0; i < summands_.size(); ++i) {
      std::vector<std::int64_t> open;
      for (const std::int64_t left : here)
        if (!decided(i, left))
          open.push_back(left);
      amounts += open.size();
      if (amounts > most_amounts)
        return false;
      // Both lists are in order.
      std::vector<std::int64_t> less(open);
      for (std::int64_t &left : less) {
        pacer_.step();
        left -= summands_[i].weight;
      }
      here.clear();
      std::set_union(less.begin(), less.end(), open.begin(), open.end(), std::back_inserter(here));
      left_.push_back(std::move(open));
    }
    return true;
  }

  FormulaId value(std::size_t i, std::int64_t left, const std::vector<FormulaId> &formulas) const {
    if (const std::optional<bool> known = decided(i, left))
      return pool_.constant(*known);
    const std::vector<std::int64_t> &known = left_[i];
    const auto place = std::lower_bound(known.begin(), known.end(), left);
    assert(place != known.end() && *place == left);
    return formulas[static_cast<std::size_t>(place - known.begin())];
  }

  FormulaPool &pool_;
  std::vector<Summand> summands_;
  bool exactly_; // whether the sum must equal the bound, else not exceed it
  BudgetPacer &pacer_;
  std::int64_t bound_ = 0;
  std::vector<std::int64_t> rest_; // maximum sum of the summands from i on
  std::vector<std::vector<std::int64_t>> left_;
};

bool is_long(const IntegerValue &a, const IntegerValue &b) {
  return a.terms.size() + b.terms.size() > short_sum;
}

} // namespace

std::optional<FormulaId> equal_long_sums(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b,
                                         BudgetPacer &pacer) {
  if (!is_long(a, b))
    return std::nullopt;
  return LongSum(pool, bounded(pool, a, b), true, pacer).formula();
}

std::optional<FormulaId> less_of_long_sums(FormulaPool &pool, const IntegerValue &a, const IntegerValue &b,
                                           BudgetPacer &pacer) {
  if (!is_long(a, b))
    return std::nullopt;
  Bounded sum = bounded(pool, a, b);
  --sum.bound;
  return LongSum(pool, std::move(sum), false, pacer).formula();
}

} // namespace slugs
