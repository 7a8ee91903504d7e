// When and how long to sift.

#include "bdd/reordering.hpp"

#include <algorithm>
#include <cassert>
#include <limits>

namespace slugs {

namespace {

constexpr std::size_t first_sift = 1u << 14;
constexpr std::size_t first_operation_limit = 1u << 18;
// Growth of the diagrams tolerated while a pair moves.  Early sifts are followed by
// others, and in the fixpoint the order is already good: there less growth suffices.
constexpr double growth = 1.2, early_growth = 1.1, late_growth = 1.05;
constexpr std::uint64_t least_work = 1u << 21;
constexpr std::uint64_t unlimited = std::numeric_limits<std::uint64_t>::max();

bool shrank(std::size_t after, std::size_t before) { return after < before - before / 5; }

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
    : store_(store), sift_at_(first_sift), operation_node_limit_(first_operation_limit) {
  assert(!store_.reordering_);
  store_.reordering_ = this;
}

Reordering::~Reordering() { store_.reordering_ = nullptr; }

std::size_t Reordering::node_limit() const {
  if (!active_)
    return std::numeric_limits<std::size_t>::max();
  return store_.live_nodes() + std::max(operation_node_limit_, 4 * store_.collected_nodes());
}

std::uint64_t Reordering::work_limit() const {
  if (!active_)
    return unlimited;
  return store_.work() + work_limit_factor_ * std::max(least_work, sifting_cost(store_.collected_nodes()));
}

void Reordering::before_operation() {
  // A collection may free little: require enough new nodes since the last one.
  const std::size_t least = std::max(sift_at_, store_.collected_nodes() + sift_at_ / 8);
  if (!active_ || in_fixpoints_ || store_.live_nodes() < least)
    return;
  store_.collect();
  const std::size_t before = store_.live_nodes();
  if (before < sift_at_)
    return;
  SiftingLog log;
  sift(store_, log, early_growth, tentative_budget());
  // If sifting gained little, postpone the next attempt.
  plan(shrank(store_.live_nodes(), before) ? 2 : 16);
}

void Reordering::after_abort(unsigned times) {
  assert(active_);
  const ScopedDisable inactive(active_);
  SiftingLog log;
  if (times == 1) {
    sift(store_, log, growth, tentative_budget());
    return;
  }
  const std::size_t before = store_.live_nodes();
  sift_all(store_, log, growth, tentative_budget());
  const bool gained = shrank(store_.live_nodes(), before);
  operation_node_limit_ *= gained ? 2 : 8;
  work_limit_factor_ *= gained ? 2 : 8;
}

// Sift repeatedly.  A pass moves each pair once, given the present positions of all
// others; later passes often gain more than the first.
SiftingLog Reordering::sift_thoroughly() {
  constexpr int most_passes = 6;
  // A pass is quadratic in the number of pairs, so very many pairs need a budget.
  constexpr std::uint32_t many = 1000;
  const std::uint64_t budget = store_.bits() > many ? tentative_budget() : unlimited;
  SiftingLog log;
  for (int pass = 0; pass < most_passes; ++pass) {
    store_.collect();
    const std::size_t before = store_.live_nodes();
    sift(store_, log, growth, budget);
    if (store_.live_nodes() > before - before / 10)
      break;
  }
  return log;
}

void Reordering::plan(std::size_t times) {
  store_.collect();
  sift_at_ = std::max<std::size_t>(times * store_.live_nodes(), first_sift);
}

void Reordering::start_fixpoints() {
  sift_thoroughly();
  in_fixpoints_ = true;
  plan(8);
  work_at_measurement_ = store_.work();
}

// Measure the work of a step in the present order, starting with an empty cache and
// stopping slightly above `limit`.
std::uint64_t Reordering::cost(const Work &step, std::uint64_t limit) {
  store_.operations_.clear_cache();
  const std::uint64_t before = store_.work();
  if (limit < unlimited)
    store_.operations_.work_limit = before + limit;
  try {
    step();
  } catch (const WorkLimitReached &) {
  }
  store_.operations_.work_limit = unlimited;
  return store_.work() - before;
}

void Reordering::between_steps(const Work &step) {
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
  constexpr std::uint64_t share = 8;
  if (expensive(store_.live_nodes()))
    sift_all(store_, log, late_growth, std::max(work / share, old_cost));
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
  plan(gained ? 4 : 16);
  work_until_measurement_ = (gained ? 2 : 16) * spent;
  work_at_measurement_ = store_.work();
}

// Estimate twice the work of sifting this many nodes: the work that should precede
// an attempt.
std::uint64_t Reordering::sifting_cost(std::size_t nodes) const {
  return std::uint64_t{4} * store_.bits() * nodes;
}

// Return the number of nodes that sifting may visit without success where its gain is
// uncertain.  It suffices to move all pairs of a diagram of size first_sift (else
// genbuf_100 ends with 25,000 nodes instead of 600), unless there are tens of
// thousands of pairs.
std::uint64_t Reordering::tentative_budget() const {
  constexpr std::uint64_t least = 1u << 22, most = 1u << 24;
  return std::clamp(sifting_cost(first_sift), least, most);
}

} // namespace slugs
