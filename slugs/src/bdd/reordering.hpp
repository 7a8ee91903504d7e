// Reordering: the mechanism (sifting) and the policy.

#pragma once

#include "bdd/bdd.hpp"
#include "bdd/unique_table.hpp"
#include "core/budget.hpp"

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace slugs {

// Reference counts of nodes, including references of handles.  They exist only
// during sifting, which frees a node with its last reference.

class References {
public:
  explicit References(MemoryAccount &account) : counts_(account) {}

  // Extend the table to this many nodes; new nodes have no references.
  void resize_for(std::size_t nodes) {
    if (nodes > counts_.size())
      counts_.resize(nodes);
  }
  void add(Edge e) {
    ++counts_[e >> 1];
    assert(counts_[e >> 1] != 0 || e <= 1); // no overflow; the constant may have any number
  }
  // Remove one reference and return whether none is left.
  bool remove(Edge e) {
    assert(counts_[e >> 1] > 0); // else a reference was not counted, or removed twice
    return --counts_[e >> 1] == 0;
  }
  bool has_any(Edge e) const { return counts_[e >> 1] > 0; }

private:
  CountedArray<std::uint32_t> counts_; // indexed by node
};

// In-place sifting (Rudell 1993) of variable pairs: the mechanism.  The policy is in
// reordering.hpp.

// Log of sifting, for undoing it: each moved pair with its former position, in the
// order of the moves.
struct SiftedPair {
  std::uint32_t bit;
  std::uint32_t from;
};
using SiftingLog = std::vector<SiftedPair>;

inline constexpr std::uint64_t unlimited_sifting = static_cast<std::uint64_t>(-1);

// If one of these functions throws LimitReached, the store may only be destroyed.
// If memory for the reference counts is short, they have no effect.

// Move each pair to its best position, largest first, and append the moves to the log.
// Stop moving a pair when the diagrams exceed `growth` times their best size.  Stop
// entirely after `budget` visited nodes; the count restarts whenever the size has
// halved.
void sift(BddStore &store, SiftingLog &log, double growth = 1.2, std::uint64_t budget = unlimited_sifting);
// Sift as above, but minimize all nodes, including garbage; then collect the garbage.
void sift_all(BddStore &store, SiftingLog &log, double growth, std::uint64_t budget);
// Undo the logged moves in reverse; no order is visited that sifting did not visit.
void undo_sifting(BddStore &store, const SiftingLog &log);

// Reordering policy: when to sift, and at what cost.
//
// As with garbage collection, any operation on handles may reorder first, or abort,
// reorder and restart, except within the scope of a CollectionPause.  Callers do
// not request it.
//
// The initial order is heuristic, and the order can change the size of diagrams by
// factors of thousands.  Sifting takes place in three situations:
//
// - An operation creates far more nodes than there were.  It is aborted and
//   restarted after sifting ("dynamic reordering" in CUDD, Somenzi 1998).  Sifting the
//   operands is cheap and often sufficient.  If not, the nodes of the aborted result
//   indicate the shape of the complete result: they are sifted with the operands.
// - While the game is built and its states are explored, diagrams that have grown are
//   sifted before the next operation.
// - Fixpoints repeat the same step.  The aim is then a cheap step, not small diagrams,
//   which sometimes make the step more expensive.  So the step is measured before and
//   after sifting, and the former order is restored if the step became more expensive.

class Reordering {
public:
  // Apply the policy to the store during the lifetime of the object.
  explicit Reordering(BddStore &store);
  ~Reordering();
  Reordering(const Reordering &) = delete;
  Reordering &operator=(const Reordering &) = delete;

  // Sift the complete relations thoroughly; then sift only in between_steps() and when
  // an operation is aborted.
  void start_fixpoints();

  // Sift in a fixpoint if it is worthwhile; `step` is representative of the next steps.
  using Work = std::function<void()>;
  void between_steps(const Work &step);

private:
  friend class BddStore;

  // Called by the store.  The limits of live_nodes() and work() at which an operation
  // that starts now is aborted:
  std::size_t node_limit() const;
  std::uint64_t work_limit() const;
  void before_operation();
  // Sift after an operation was aborted for the `times`-th time.
  void after_abort(unsigned times);

  SiftingLog sift_thoroughly();
  void plan(std::size_t times);
  std::uint64_t sifting_cost(std::size_t nodes) const;
  std::uint64_t tentative_budget() const;
  std::uint64_t cost(const Work &step, std::uint64_t limit);

  BddStore &store_;
  const Tuning &tuning_;
  bool in_fixpoints_ = false;
  bool active_ = true; // false while a step is measured and during sifting itself
  std::size_t sift_at_;
  std::size_t operation_node_limit_;      // nodes that an operation may create
  std::uint64_t work_limit_factor_ = 1;   // work that an operation may take, as a multiple of sifting_cost()
  std::uint64_t work_at_measurement_ = 0; // work() at the last measurement of a step
  std::uint64_t work_until_measurement_ = 0; // work from then to the next measurement
};

} // namespace slugs
