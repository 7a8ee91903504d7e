// When diagrams are reordered, and how much that may cost.
//
// The convention is that of garbage collection: any operation on handles may
// reorder the diagrams first, or give up, reorder and start again; none does
// while a CollectionPause lives.  Nobody has to ask for it.
//
// The start order is a guess, and between a good and a bad order lie factors of
// thousands.  So there are three occasions:
//
// - An operation that makes far more nodes than there were is given up: the
//   diagrams are sifted, and it restarts ("dynamic reordering" in CUDD,
//   Somenzi 1998).  Sifting the operands is cheap and often enough.  Where it is
//   not, what the operation had made so far says what the product is going to
//   look like: its nodes are sifted together with the operands.
// - While the game is being built and its states are being explored, diagrams
//   that have grown are sifted before they are worked on.
// - In the fixpoints the same step is taken repeatedly.  There the aim is
//   not small diagrams but cheap steps, and sometimes the former makes the latter
//   more expensive.  So a step is measured before and after, and if sifting was for the
//   worse, the former order is restored.

#pragma once

#include "bdd/bdd.hpp"
#include "bdd/sifting.hpp"

#include <cstddef>
#include <functional>

namespace slugs {

class Reordering {
public:
  // The store obeys it for as long as it lives.
  explicit Reordering(BddStore &store);
  ~Reordering();
  Reordering(const Reordering &) = delete;
  Reordering &operator=(const Reordering &) = delete;

  // The relations are as they will stay: one thorough sift, then only at steps.
  void settle();

  // In a fixpoint, between steps: `step` is one such as those to come.
  using Work = std::function<void()>;
  void between_steps(const Work &step);

private:
  friend class BddStore;

  // Called by the store.  How many nodes may live, and how far work() may have
  // come, before an operation that starts now is given up:
  std::size_t most_nodes() const;
  std::uint64_t most_work() const;
  void before_operation();
  // An operation made more; it was given up `times` times.
  void after_giving_up(unsigned times);

  SiftingLog sift_thoroughly();
  void plan(std::size_t times);
  std::uint64_t effort(std::size_t nodes) const;
  std::uint64_t gamble() const;
  std::uint64_t cost(const Work &step, std::uint64_t limit);

  BddStore &store_;
  bool settled_ = false;
  bool active_ = true; // not while a step is measured, nor in our own operations
  std::size_t sift_at_;
  std::size_t allowance_;        // of nodes for an operation
  std::uint64_t indulgence_ = 1; // of work for an operation, in efforts
  std::uint64_t worked_ = 0;     // when a step was last measured
  std::uint64_t patience_ = 0;   // work until the next time
};

} // namespace slugs
