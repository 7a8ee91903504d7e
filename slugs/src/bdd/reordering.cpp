// When and how long to sift.

#include "bdd/reordering.hpp"

#include <algorithm>
#include <cassert>
#include <limits>

namespace slugs {

namespace {

constexpr std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();

// Growth of the diagrams tolerated while a pair moves.  Early sifts are followed by
// others, and in the fixpoint the order is already good: there less growth suffices.
double ratio(std::size_t per_cent) { return static_cast<double>(per_cent) / 100; }

bool shrank(std::size_t after, std::size_t before) {
  assert(after <= before); // sifting ends at the best position
  return after < before - before / 5;
}

class ScopedDisable {
public:
  explicit ScopedDisable(bool &flag) : flag_(flag), before_(flag) { flag_ = false; }
  ~ScopedDisable() { flag_ = before_; }
  ScopedDisable(const ScopedDisable &) = delete;
  ScopedDisable &operator=(const ScopedDisable &) = delete;

private:
  bool &flag_;
  bool before_;
};

} // namespace

Reordering::Reordering(BddStore &store)
    : store_(store), tuning_(store.tuning()), sift_at_(tuning_.sift_first),
      operation_node_limit_(tuning_.operation_nodes) {
  assert(!store_.reordering_);
  store_.reordering_ = this;
}

Reordering::~Reordering() {
  assert(store_.reordering_ == this);
  store_.reordering_ = nullptr;
}

std::size_t Reordering::node_limit() const {
  if (!active_)
    return std::numeric_limits<std::size_t>::max();
  return store_.live_nodes() + std::max(operation_node_limit_, 4 * store_.collected_nodes());
}

std::uint64_t Reordering::work_limit() const {
  if (!active_)
    return unlimited;
  return store_.work() + work_limit_factor_ * std::max<std::uint64_t>(tuning_.operation_work,
                                                                      sifting_cost(store_.collected_nodes()));
}

void Reordering::before_operation() {
  // A collection may free little: require enough new nodes since the last one.
  const std::size_t least = std::max(sift_at_, store_.collected_nodes() + sift_at_ / 8);
  if (!active_ || in_fixpoints_ || store_.live_nodes() < least)
    return;
  store_.collect();
  assert(store_.collected_nodes() == store_.live_nodes());
  const std::size_t before = store_.live_nodes();
  if (before < sift_at_)
    return;
  SiftingLog log;
  sift(store_, log, ratio(tuning_.growth_early), tentative_budget());
  // If sifting gained little, postpone the next attempt.
  plan(shrank(store_.live_nodes(), before) ? tuning_.sift_later : tuning_.sift_vain);
}

void Reordering::after_abort(unsigned times) {
  assert(active_ && times > 0);
  const ScopedDisable inactive(active_);
  SiftingLog log;
  if (times == 1) {
    sift(store_, log, ratio(tuning_.growth), tentative_budget());
    return;
  }
  const std::size_t before = store_.live_nodes();
  sift_all(store_, log, ratio(tuning_.growth), tentative_budget());
  const bool gained = shrank(store_.live_nodes(), before);
  const std::size_t factor = gained ? tuning_.operation_later : tuning_.operation_vain;
  assert(factor > 1); // else the operation could be abandoned forever
  operation_node_limit_ *= factor;
  work_limit_factor_ *= factor;
}

// Sift repeatedly.  A pass moves each pair once, given the present positions of all
// others; later passes often gain more than the first.
SiftingLog Reordering::sift_thoroughly() {
  // A pass is quadratic in the number of pairs, so very many pairs need a budget.
  const std::uint64_t budget = store_.bits() > tuning_.sift_pairs ? tentative_budget() : unlimited;
  SiftingLog log;
  for (std::size_t pass = 0; pass < tuning_.sift_passes; ++pass) {
    store_.collect();
    const std::size_t before = store_.live_nodes();
    sift(store_, log, ratio(tuning_.growth), budget);
    assert(store_.live_nodes() <= before);
    if (store_.live_nodes() > before - before / 10)
      break;
  }
  return log;
}

void Reordering::plan(std::size_t times) {
  assert(times > 1);
  store_.collect();
  sift_at_ = std::max(times * store_.live_nodes(), tuning_.sift_first);
}

void Reordering::start_fixpoints() {
  assert(!in_fixpoints_);
  sift_thoroughly();
  in_fixpoints_ = true;
  plan(tuning_.sift_fixpoints);
  work_at_measurement_ = store_.work();
}

// Measure the work of a step in the present order, starting with an empty cache and
// stopping slightly above `limit`.
std::uint64_t Reordering::cost(const Work &step, std::uint64_t limit) {
  assert(!active_ && in_fixpoints_);
  store_.operations_.clear_cache();
  const std::uint64_t before = store_.work();
  if (limit < unlimited)
    store_.operations_.work_limit = before + limit;
  try {
    step();
  } catch (const WorkLimitReached &) {
  }
  store_.operations_.work_limit = unlimited;
  assert(store_.work() >= before);
  return store_.work() - before;
}

void Reordering::between_steps(const Work &step) {
  assert(in_fixpoints_ && store_.work() >= work_at_measurement_);
  const std::uint64_t work = store_.work() - work_at_measurement_;
  const auto expensive = [&](std::size_t nodes) {
    return work >= work_until_measurement_ && work >= sifting_cost(nodes);
  };
  if (store_.collected_nodes() < sift_at_ && !expensive(store_.collected_nodes()))
    return;
  store_.collect();
  const bool grown = store_.live_nodes() >= sift_at_;
  if (!grown && !expensive(store_.live_nodes()))
    return;
  const ScopedDisable inactive(active_);
  const std::uint64_t old_cost = cost(step, unlimited);
  const std::uint64_t sifting_before = store_.sifting_work();
  SiftingLog log;
  // Much work may only mean that the game is large and its steps are cheap.  Then the
  // gain is uncertain, and sifting may take only a share of the work.
  if (expensive(store_.live_nodes()))
    sift_all(store_, log, ratio(tuning_.growth_late), std::max(work / tuning_.sift_share, old_cost));
  else if (grown)
    log = sift_thoroughly();
  else {
    work_until_measurement_ = sifting_cost(store_.live_nodes());
    return;
  }
  const std::uint64_t new_cost = cost(step, old_cost);
  if (new_cost > old_cost)
    undo_sifting(store_, log);
  const bool gained = new_cost < old_cost - old_cost / 5;
  const std::uint64_t spent = (store_.sifting_work() - sifting_before) / 2 + std::min(new_cost, old_cost);
  // If sifting gained little, postpone the next attempt.
  plan(gained ? tuning_.sift_step : tuning_.sift_vain);
  work_until_measurement_ = (gained ? tuning_.sift_later : tuning_.sift_vain) * spent;
  work_at_measurement_ = store_.work();
}

// Estimate twice the work of sifting this many nodes: the work that should precede
// an attempt.
std::uint64_t Reordering::sifting_cost(std::size_t nodes) const {
  return std::uint64_t{4} * store_.bits() * nodes;
}

// Return the number of nodes that sifting may visit without success where its gain is
// uncertain.  It suffices to move all pairs of a diagram of size sift_first (else
// genbuf_100 ends with 25,000 nodes instead of 600), unless there are tens of
// thousands of pairs.
std::uint64_t Reordering::tentative_budget() const {
  assert(tuning_.sift_least <= tuning_.sift_most);
  return std::clamp<std::uint64_t>(sifting_cost(tuning_.sift_first), tuning_.sift_least, tuning_.sift_most);
}

} // namespace slugs
