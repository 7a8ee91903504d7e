// See certificate/moves/backtracking.hpp.

#include "certificate/moves/backtracking.hpp"

#include <algorithm>

namespace slugs {

namespace {

constexpr std::size_t lane_variables = 6;
constexpr LaneBits lane_patterns[lane_variables] = {0xAAAAAAAAAAAAAAAAull, 0xCCCCCCCCCCCCCCCCull,
                                                    0xF0F0F0F0F0F0F0F0ull, 0xFF00FF00FF00FF00ull,
                                                    0xFFFF0000FFFF0000ull, 0xFFFFFFFF00000000ull};

// Branches from the last variable to the first: integers are little-endian, and
// their high bits decide comparisons.
class Search {
public:
  Search(const FormulaPool &pool, const std::vector<FormulaId> &formulas,
         const std::vector<OpenVariable> &variables, std::size_t variable_count, std::uint64_t most,
         const Budget &budget)
      : formulas_(formulas), variables_(variables), most_(most), budget_(budget), evaluation_(pool, formulas),
        assignment_(variable_count), on_lanes_(std::min(variables.size(), lane_variables)) {}

  std::vector<std::vector<bool>> run() {
    for (std::size_t i = 0; i < on_lanes_; ++i)
      truth(i) = known(lane_patterns[i]);
    // Variables at or above `level` have a value, those between on_lanes_ and
    // level none.
    std::size_t level = variables_.size();
    bool forward = possible();
    if (level == on_lanes_) {
      if (forward)
        collect();
      return std::move(found_);
    }
    while (true) {
      if (forward && level > on_lanes_) {
        set(--level, false);
      } else {
        // Return to the last variable that is false, and make it true.
        while (level < variables_.size() && value(level))
          truth(level++) = Truth{};
        if (level == variables_.size() || found_.size() >= most_)
          return std::move(found_);
        set(level, true);
      }
      forward = possible();
      if (forward && level == on_lanes_)
        collect();
    }
  }

private:
  Truth &truth(std::size_t i) {
    return (variables_[i].next ? assignment_.next : assignment_.current)[variables_[i].index];
  }
  void set(std::size_t i, bool value) { truth(i) = known(value ? ~LaneBits{0} : 0); }
  bool value(std::size_t i) { return truth(i).yes != 0; }

  // Whether some lane violates no formula yet.
  bool possible() {
    if ((++evaluations_ & 0xFFF) == 0)
      budget_.check();
    evaluation_.run(assignment_);
    alive_ = on_lanes_ == lane_variables ? ~LaneBits{0} : (LaneBits{1} << (std::size_t{1} << on_lanes_)) - 1;
    for (const FormulaId formula : formulas_)
      alive_ &= ~evaluation_[formula].no;
    return alive_ != 0;
  }

  void collect() {
    for (unsigned lane = 0; lane < lanes && found_.size() < most_; ++lane) {
      if (!((alive_ >> lane) & 1))
        continue;
      std::vector<bool> solution(variables_.size());
      for (std::size_t i = 0; i < variables_.size(); ++i)
        solution[i] = (truth(i).yes >> lane) & 1;
      found_.push_back(std::move(solution));
    }
  }

  const std::vector<FormulaId> &formulas_;
  const std::vector<OpenVariable> &variables_;
  const std::uint64_t most_;
  const Budget &budget_;
  Evaluation evaluation_;
  Assignment assignment_;
  const std::size_t on_lanes_;
  LaneBits alive_ = 0;
  std::uint64_t evaluations_ = 0;
  std::vector<std::vector<bool>> found_;
};

} // namespace

std::vector<std::vector<bool>> solutions(const FormulaPool &pool, const std::vector<FormulaId> &formulas,
                                         const std::vector<OpenVariable> &variables,
                                         std::size_t variable_count, std::uint64_t most,
                                         const Budget &budget) {
  return Search(pool, formulas, variables, variable_count, most, budget).run();
}

} // namespace slugs
