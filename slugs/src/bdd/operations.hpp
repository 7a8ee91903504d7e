// Operations on edges.
//
// They never collect garbage: a result is valid until the owner of the table sweeps
// it.  A set of quantified variables is an index, not a cube.

#pragma once

#include "bdd/unique_table.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

// Thrown by an operation when the total work exceeds Operations::work_limit.
struct WorkLimitReached {};

class Operations {
public:
  Operations(std::uint32_t bits, const std::vector<std::uint32_t> &order, MemoryAccount &account)
      : cache_(account), table_(bits, order, account, cache_) {}
  Operations(const Operations &) = delete;
  Operations &operator=(const Operations &) = delete;

  static bool is_terminal(Edge f) { return f <= 1; }
  Var var_of(Edge f) const { return table_.var_of(f); }
  Edge low_of(Edge f) const { return table_.low_of(f); }
  Edge high_of(Edge f) const { return table_.high_of(f); }

  // "if v then high else low", where v is above both operands in the order.
  Edge node(Var v, Edge low, Edge high) { return table_.make(v, low, high); }
  // The same for any position of v.
  Edge branch(Var v, Edge low, Edge high);
  Edge cofactor(Edge f, Var v, bool value);

  Edge conjunction(Edge f, Edge g);
  Edge disjunction(Edge f, Edge g) { return conjunction(f ^ 1, g ^ 1) ^ 1; }
  Edge exclusive_or(Edge f, Edge g);
  Edge ite(Edge f, Edge g, Edge h); // if f then g else h

  VarSet make_set(const std::vector<Var> &members);
  bool is_empty(VarSet set) const {
    assert(set < sets_.size());
    return sets_[set].empty;
  }
  bool is_alive(Edge f) const { return table_.alive(f); }
  Edge exists(Edge f, VarSet set);
  Edge and_exists(Edge f, Edge g, VarSet set); // exists set. f & g
  // f & !exists set. g & h, where f depends on no variable of the set.  The set must
  // be that of the last call of select_minus_set.
  void select_minus_set(VarSet set);
  Edge minus_and_exists(Edge f, Edge g, Edge h, VarSet set);
  // Rename current to next variables or back; f must depend on one kind only.
  enum Direction : Edge { ToCurrent = 0, ToNext = 1 };
  Edge shift(Edge f, Direction direction);
  // Return a function that agrees with f on the care set, which must not be false.
  Edge simplify(Edge f, Edge care);

  // Free all unmarked nodes and remove their cached results.
  void sweep();
  // Clear the cache, so that the cost of an operation does not depend on earlier ones.
  void clear_cache() { cache_.clear(); }
  void order_changed();

  static constexpr std::uint64_t unlimited_work = static_cast<std::uint64_t>(-1);
  std::uint64_t work() const { return work_; } // steps that missed the cache so far
  // Limits of work(), checked every 16384 steps.
  std::uint64_t work_limit = unlimited_work;          // else WorkLimitReached
  std::uint64_t most_operation_work = unlimited_work; // else OperationAborted

  UniqueTable &table() { return table_; }
  const UniqueTable &table() const { return table_; }

private:
  struct QuantifiedSet {
    std::vector<std::uint8_t> contains; // indexed by variable
    std::uint32_t last_level = 0;       // lowest level of a member
    bool empty = true;
  };

  bool find_or_count_step(Operation op, Edge f, Edge g, Edge h, Edge &result);
  void find_last_level(QuantifiedSet &set) const;
  // Return whether the topmost variable of f, if any, is not in the set; for assertions.
  bool is_free_of(Edge f, VarSet set) const { return !sets_[set].contains[table_.var_of(f)]; }

  OperationCache cache_;
  UniqueTable table_;
  std::uint64_t work_ = 0;
  std::vector<QuantifiedSet> sets_;
  VarSet minus_set_ = 0; // set of the cached results of MinusExistsBoth
};

} // namespace slugs
