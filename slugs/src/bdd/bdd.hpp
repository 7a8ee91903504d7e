// Public interface of the BDD package: handles, and the store that owns all nodes.
//
// Differences from general packages such as CUDD:
//
// - Variables come in pairs, current and next, see bdd/unique_table.hpp.
// - A set of quantified variables is an index, not a cube.
// - There are no reference counts.  Handles (Bdd) form a linked list; garbage
//   collection frees nodes that no handle reaches, between operations only.
// - Reordering works in place: an edge keeps its function.  Any operation on
//   handles may reorder first, see bdd/reordering.hpp.
//
// Code that traverses diagrams node by node uses the operations on edges
// (operations.hpp).  Only this folder accesses the unique table (unique_table.hpp).

#pragma once

#include "bdd/operations.hpp"
#include "bdd/unique_table.hpp"
#include "core/budget.hpp"

#include <cassert>
#include <cstdint>
#include <vector>

namespace slugs {

class BddStore;
class Reordering;

// Handle of a function: it protects its nodes from garbage collection.
class Bdd {
public:
  Bdd() = default;
  Bdd(BddStore &store, Edge edge) : store_(&store), edge_(edge) { link(); }
  Bdd(const Bdd &other) : store_(other.store_), edge_(other.edge_) { link(); }
  Bdd &operator=(const Bdd &other) {
    if (store_ != other.store_) {
      unlink();
      store_ = other.store_;
      link();
    }
    edge_ = other.edge_;
    return *this;
  }
  ~Bdd() { unlink(); }

  Edge edge() const { return edge_; }
  bool is_false() const { return edge_ == bdd_false; }
  bool is_true() const { return edge_ == bdd_true; }
  bool operator==(const Bdd &other) const { return edge_ == other.edge_; }
  bool operator!=(const Bdd &other) const { return edge_ != other.edge_; }

  Bdd operator!() const {
    assert(store_);
    return Bdd(*store_, edge_ ^ 1);
  }
  Bdd operator&(const Bdd &other) const;
  Bdd operator|(const Bdd &other) const;
  Bdd operator^(const Bdd &other) const;
  Bdd &operator&=(const Bdd &other) { return *this = *this & other; }
  Bdd &operator|=(const Bdd &other) { return *this = *this | other; }

private:
  friend class BddStore;
  friend class Sifting;
  void link();
  void unlink();

  BddStore *store_ = nullptr;
  Edge edge_ = bdd_false;
  Bdd *before_ = nullptr;
  Bdd *after_ = nullptr;
};

class BddStore {
public:
  // `bits`: number of variable pairs; order[k]: bit whose pair is at position k.
  BddStore(std::uint32_t bits, const std::vector<std::uint32_t> &order, const Budget &budget);
  BddStore(const BddStore &) = delete;
  BddStore &operator=(const BddStore &) = delete;

  Bdd constant(bool value) { return Bdd(*this, value ? bdd_true : bdd_false); }
  Bdd variable(Var v);

  // Each operation may first collect garbage or reorder.
  Bdd conjunction(const Bdd &f, const Bdd &g);
  Bdd exclusive_or(const Bdd &f, const Bdd &g);
  Bdd ite(const Bdd &f, const Bdd &g, const Bdd &h); // if f then g else h

  VarSet make_set(const std::vector<Var> &members) { return operations_.make_set(members); }
  Bdd exists(const Bdd &f, VarSet set);
  Bdd forall(const Bdd &f, VarSet set);
  Bdd and_exists(const Bdd &f, const Bdd &g, VarSet set); // exists set. f & g
  // f & !exists set. g & h, where f depends on no variable of the set.  Restricting
  // the computation to f is often orders of magnitude faster.
  Bdd minus_and_exists(const Bdd &f, const Bdd &g, const Bdd &h, VarSet set);
  // Rename current to next variables; f must not depend on next variables.
  Bdd to_next(const Bdd &f);
  // Rename next to current variables; f must not depend on current variables.
  Bdd to_current(const Bdd &f);
  // Return a function that agrees with f on the care set, often a smaller one
  // (Coudert and Madre 1990, "restrict").  `care` must not be false.
  Bdd simplify(const Bdd &f, const Bdd &care);

  // Return whether the handle belongs to this store and protects a node of it; and
  // whether f implies g.  For assertions.
  bool owns(const Bdd &f) const { return f.store_ == this && operations_.is_alive(f.edge()); }
  bool implies(const Bdd &f, const Bdd &g) { return conjunction(f, !g).is_false(); }

  bool evaluate(Edge f, const std::vector<bool> &value_of_var) const;
  double count(const Bdd &f, const std::vector<Var> &over) const; // satisfying valuations; `over` ⊇ support
  std::vector<bool> some_valuation(const Bdd &f) const;           // indexed by variable; f is not false
  std::vector<Var> support(const Bdd &f);                         // ascending
  std::size_t size(const Bdd &f);                                 // nodes, without the constant

  std::uint32_t bits() const { return operations_.table().bits(); }
  std::uint32_t level_of(Var v) const { return operations_.table().level_of(v); }
  Var var_at(std::uint32_t level) const { return operations_.table().var_at(level); }

  // Operations without handles, for extraction: results are valid until the next
  // operation that can collect.
  Operations &edges() { return operations_; }
  void collect_or_reorder_if_due() { before_operation(); } // collect garbage or reorder if due
  void collect();

  MemoryAccount &account() { return account_; }
  const Tuning &tuning() const { return account_.budget().tuning; }
  // Survivors of the last collection plus all nodes created since.
  std::size_t live_nodes() const { return operations_.table().live(); }
  std::size_t collected_nodes() const { return collected_; } // survivors of the last collection
  std::size_t peak_nodes() const { return operations_.table().peak(); }
  std::uint64_t collections() const { return collections_; }
  std::uint64_t reorderings() const { return reorderings_; }
  std::uint64_t work() const { return operations_.work(); }    // operation steps so far
  std::uint64_t sifting_work() const { return sifting_work_; } // nodes visited by sifting so far

  // Throw std::logic_error if an invariant is violated.
  void assert_consistent() const;

private:
  friend class Bdd;
  friend class CollectionPause;
  friend class Reordering; // policy
  friend class Sifting;    // mechanism

  template <typename Work> Bdd run(const Work &work);
  void before_operation();
  void set_bounds();
  void release_bounds();
  void plan_collection();
  void order_changed();

  MemoryAccount account_;
  Operations operations_;
  Bdd *handles_ = nullptr;
  Reordering *reordering_ = nullptr;
  bool collection_allowed_ = true;
  std::size_t collect_at_ = 0;
  std::size_t collected_ = 0;
  std::uint64_t collections_ = 0;
  std::uint64_t reorderings_ = 0;
  std::uint64_t sifting_work_ = 0;
};

// Scope in which only explicit calls of collect() invalidate edges without handles.
class CollectionPause {
public:
  explicit CollectionPause(BddStore &store) : store_(store) {
    assert(store.collection_allowed_); // pauses do not nest
    store.collection_allowed_ = false;
  }
  ~CollectionPause() { store_.collection_allowed_ = true; }
  CollectionPause(const CollectionPause &) = delete;
  CollectionPause &operator=(const CollectionPause &) = delete;

private:
  BddStore &store_;
};

inline Bdd Bdd::operator&(const Bdd &other) const {
  assert(store_ && store_ == other.store_);
  return store_->conjunction(*this, other);
}
inline Bdd Bdd::operator|(const Bdd &other) const { return !((!*this) & (!other)); }
inline Bdd Bdd::operator^(const Bdd &other) const {
  assert(store_ && store_ == other.store_);
  return store_->exclusive_or(*this, other);
}

// A function stored outside of the BDD store.
//
// The fixpoints keep one set of states per round and goal for the strategy.  In the
// store these sets would outweigh the relations: every collection would mark them,
// and sifting would optimize the order for them.  As lists of nodes they can be
// rebuilt in any later order.

class FrozenBdd {
public:
  FrozenBdd(BddStore &store, const Bdd &f);
  Bdd thaw(BddStore &store) const;
  std::size_t size() const { return nodes_.size(); }

private:
  struct Node {
    Var var;
    Edge low, high; // edges whose node indices are positions in nodes_, from 1; 0: constant
  };
  CountedArray<Node> nodes_; // children before parents
  Edge root_ = bdd_false;
};

} // namespace slugs
