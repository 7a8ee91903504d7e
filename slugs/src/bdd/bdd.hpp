// Reduced ordered binary decision diagrams, made for two-player games.
//
// The classical construction (Bryant 1986; Brace, Rudell and Bryant 1990) with
// complement edges, one unique table for all variables and one operation cache
// that grows with it.  What is particular:
//
// - Variables come in pairs: 2i is the current and 2i + 1 the next value of bit
//   i.  A pair always occupies two adjacent levels, current above next, so that
//   priming a function is a relabelling of its nodes and keeps its shape.
// - A set of quantified variables is a small number, not a diagram.
// - No reference counts.  Handles (Bdd) form a list; nodes that no handle can
//   reach are swept between operations, never within one.
// - Reordering works in place: an edge keeps its function.
//
// An edge is twice a node index, plus one if complemented.  Node 0 is the
// constant false, so the edges 0 and 1 are false and true.  The low edge of a
// node is never complemented; that makes the form canonical.

#pragma once

#include "core/counted_array.hpp"

#include <cassert>
#include <cstdint>
#include <vector>

namespace slugs {

using Edge = std::uint32_t;
using Var = std::uint32_t;
using VarSet = std::uint32_t; // named by BddStore::make_set

inline constexpr Edge bdd_false = 0;
inline constexpr Edge bdd_true = 1;

constexpr Var current_var(std::uint32_t bit) { return 2 * bit; }
constexpr Var next_var(std::uint32_t bit) { return 2 * bit + 1; }

class BddStore;
class Reordering;

// What sifting did, so that it can be undone: each pair that moved, and from
// which position, in the order of the moves.
struct SiftedPair {
  std::uint32_t bit;
  std::uint32_t from;
};
using SiftingLog = std::vector<SiftedPair>;

// A handle: what it names survives collections.
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

  Bdd operator!() const { return Bdd(*store_, edge_ ^ 1); }
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
  // `bits` pairs of variables; order[k] is the bit whose pair is at position k.
  BddStore(std::uint32_t bits, const std::vector<std::uint32_t> &order, const Budget &budget);
  BddStore(const BddStore &) = delete;
  BddStore &operator=(const BddStore &) = delete;

  Bdd constant(bool value) { return Bdd(*this, value ? bdd_true : bdd_false); }
  Bdd variable(Var v);

  // Boolean operations; each may first collect garbage.
  Bdd conjunction(const Bdd &f, const Bdd &g);
  Bdd exclusive(const Bdd &f, const Bdd &g);
  Bdd choice(const Bdd &f, const Bdd &g, const Bdd &h); // if f then g else h

  VarSet make_set(const std::vector<Var> &members);
  Bdd exists(const Bdd &f, VarSet set);
  Bdd forall(const Bdd &f, VarSet set);
  Bdd exists_both(const Bdd &f, const Bdd &g, VarSet set); // exists set. f & g
  // f & !exists set. g & h, where f depends on no variable of the set.  Nothing is
  // computed outside f, which often makes all the difference.
  Bdd minus_exists_both(const Bdd &f, const Bdd &g, const Bdd &h, VarSet set);
  // Relabels current to next variables; f must depend on no next variable.
  Bdd to_next(const Bdd &f);
  // Relabels next to current variables; f must depend on no current variable.
  Bdd to_current(const Bdd &f);
  // A function that agrees with f wherever `care` holds, often smaller
  // (Coudert and Madre 1990, "restrict").  `care` must not be false.
  Bdd simplify(const Bdd &f, const Bdd &care);

  // Without handles, for extraction: results live until the next operation
  // that can collect.
  Edge and_edge(Edge f, Edge g) { return and_(f, g); }
  Edge or_edge(Edge f, Edge g) { return or_(f, g); }
  Edge cofactor_edge(Edge f, Var v, bool value);
  bool is_terminal(Edge f) const { return f <= 1; }
  Var var_of(Edge f) const { return node_of(f).var; }
  Edge low_of(Edge f) const { return node_of(f).low ^ (f & 1); }
  Edge high_of(Edge f) const { return node_of(f).high ^ (f & 1); }
  Edge node(Var v, Edge low, Edge high);        // the function "if v then high else low"; v above both
  Edge branch_edge(Var v, Edge low, Edge high); // the same, wherever v is
  void make_room() { before_operation(); }      // collects if it is time to
  std::uint32_t level_of(Var v) const { return level_of_var_[v]; }
  Var var_at(std::uint32_t level) const { return var_at_level_[level]; }

  bool evaluate(Edge f, const std::vector<bool> &value_of_var) const;
  double count(const Bdd &f, const std::vector<Var> &over); // satisfying valuations of `over` ⊇ support
  std::vector<bool> some_valuation(const Bdd &f) const;     // by variable; f is not false
  std::vector<Var> support(const Bdd &f);                   // ascending
  std::size_t size(const Bdd &f);                           // nodes, without the constant

  void collect();
  // Moves each pair to its best position, largest first (Rudell 1993).  Stops
  // moving a pair when the diagrams exceed `growth` times their best size.
  // Appends to the log.  Moves no more pairs after it has looked at `budget` nodes
  // without effect; each time that the diagrams have been halved it starts to count anew.
  // After a LimitReached out of here or undo() nothing but destruction is safe.
  void sift(SiftingLog &log, double growth = 1.2, std::uint64_t budget = unlimited_sifting);
  // The same for all nodes, also those that no handle can reach.  They are gone afterwards.
  void sift_all(SiftingLog &log, double growth, std::uint64_t budget);
  static constexpr std::uint64_t unlimited_sifting = static_cast<std::uint64_t>(-1);
  // The reverse moves: every order on the way has been there before.
  void undo(const SiftingLog &log);
  // Forgets results, so that what an operation costs does not depend on the past.
  void clear_cache() { cache_.clear_to_zero(); }
  std::uint64_t work() const { return work_; }                 // steps of operations so far
  std::uint64_t sifting_work() const { return sifting_work_; } // nodes looked at by reordering so far

  std::uint32_t bits() const { return static_cast<std::uint32_t>(level_of_var_.size() / 2); }
  std::size_t live_nodes() const { return live_; }           // as of the last collection plus all made since
  std::size_t collected_nodes() const { return collected_; } // that survived the last collection
  std::size_t peak_nodes() const { return peak_; }
  std::uint64_t collections() const { return collections_; }
  std::uint64_t reorderings() const { return reorderings_; }
  MemoryAccount &account() { return account_; }

  // Throws std::logic_error if an invariant is broken.  For tests.
  void assert_consistent() const;

private:
  friend class Bdd;
  friend class Sifting;
  friend class Reordering;
  friend class CollectionPause;

  struct Node {
    Edge low;
    Edge high;
    std::uint32_t chain; // next node in its bucket or in the free list
    Var var;             // free_var if free
  };
  struct CacheEntry {
    std::uint32_t f_and_operation; // 0 in an empty entry
    std::uint32_t g;
    std::uint32_t h;
    Edge result;
  };
  struct QuantifiedSet {
    std::vector<std::uint8_t> contains; // by variable
    std::uint32_t last_level = 0;       // of its members
    bool empty = true;
  };
  enum Operation : std::uint32_t {
    And = 1,
    Xor,
    Choice,
    Exists,
    ExistsBoth,
    MinusExistsBoth,
    Shift,
    Simplify
  };

  enum Direction : Edge { ToCurrent = 0, ToNext = 1 };

  static constexpr Var free_var = 0xFFFFFFFF;
  static constexpr std::uint32_t max_nodes = 1u << 28;
  static constexpr unsigned operation_shift = 29;
  static constexpr std::size_t unbounded = static_cast<std::size_t>(-1);
  static constexpr std::uint64_t unlimited_work = static_cast<std::uint64_t>(-1);

  // Thrown by an operation that makes more nodes or takes more steps than it may,
  // see run().
  struct Outgrown {};
  // Thrown by an operation when work() exceeds what Reordering allows.
  struct Overworked {};

  // Runs an operation on handles.  One that grows too large or takes too long
  // is repeated in a better order.  Where memory is short, garbage is swept and the operation
  // repeated before it is given up.
  template <typename Operation> Bdd run(Operation operation) {
    before_operation();
    for (unsigned given_up = 0;;) {
      try {
        set_bounds();
        const Edge result = operation();
        release_bounds();
        return Bdd(*this, result);
      } catch (const Outgrown &) {
        release_bounds();
        reorder_for_operation(++given_up);
      } catch (const LimitReached &limit) {
        release_bounds();
        if (limit.kind != LimitKind::Memory || !collection_allowed_)
          throw;
        collect();
        return Bdd(*this, operation());
      }
    }
  }
  bool alive(Edge f) const { return (f >> 1) < used_ && nodes_[f >> 1].var != free_var; }
  const Node &node_of(Edge f) const {
    assert(alive(f));
    return nodes_[f >> 1];
  }
  std::uint32_t level(Edge f) const { return level_of_var_[node_of(f).var]; }

  Edge make(Var v, Edge low, Edge high);
  std::uint32_t allocate();
  void grow_nodes();
  void grow_buckets();
  void resize_cache();
  void before_operation();
  void set_bounds();
  void release_bounds() { most_nodes_ = unbounded, most_operation_work_ = unlimited_work; }
  void reorder_for_operation(unsigned given_up);
  void plan_collection();
  void check_budget();
  void order_changed();
  void after_sifting();
  std::size_t bucket(Var v, Edge low, Edge high) const;

  CacheEntry &cache_slot(std::uint32_t f, std::uint32_t g, std::uint32_t h);
  bool known_or_step(Operation op, Edge f, Edge g, Edge h, Edge &result);
  void remember(Operation op, Edge f, Edge g, Edge h, Edge result);

  Edge and_(Edge f, Edge g);
  Edge or_(Edge f, Edge g) { return and_(f ^ 1, g ^ 1) ^ 1; }
  Edge xor_(Edge f, Edge g);
  Edge choice_(Edge f, Edge g, Edge h);
  Edge exists_(Edge f, VarSet set);
  Edge exists_both_(Edge f, Edge g, VarSet set);
  Edge minus_exists_both_(Edge f, Edge g, Edge h, VarSet set);
  Edge shift_(Edge f, Direction direction);
  Edge simplify_(Edge f, Edge care);

  void mark(Edge f);
  bool marked(std::uint32_t n) const { return (marks_[n >> 5] >> (n & 31)) & 1; }
  void set_mark(std::uint32_t n) { marks_[n >> 5] |= 1u << (n & 31); }
  void clear_marks();

  MemoryAccount account_;
  CountedArray<Node> nodes_;
  CountedArray<std::uint32_t> buckets_; // heads of chains; 0 is the empty chain
  CountedArray<CacheEntry> cache_;
  CountedArray<std::uint32_t> marks_;
  std::uint32_t used_ = 1;      // nodes_[used_..] have never been used
  std::uint32_t free_list_ = 0; // 0 if empty
  std::size_t live_ = 0;
  std::size_t peak_ = 0;
  std::size_t collected_ = 0;
  std::size_t collect_at_ = 0;
  bool collection_allowed_ = true;
  Reordering *reordering_ = nullptr;
  std::size_t most_nodes_ = unbounded;
  std::uint64_t collections_ = 0;
  std::uint64_t reorderings_ = 0;
  std::uint64_t work_ = 0;
  std::uint64_t sifting_work_ = 0;
  std::uint64_t most_work_ = unlimited_work;
  std::uint64_t most_operation_work_ = unlimited_work;
  std::vector<std::uint32_t> level_of_var_; // the constant's pseudo-variable is last, below all
  std::vector<Var> var_at_level_;
  std::vector<QuantifiedSet> sets_;
  VarSet minus_set_ = 0; // of the results of MinusExistsBoth that are known
  Bdd *handles_ = nullptr;
};

// While it lives, edges without handles stay valid until collect() is called.
class CollectionPause {
public:
  explicit CollectionPause(BddStore &store) : store_(store) { store.collection_allowed_ = false; }
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
  return store_->exclusive(*this, other);
}

} // namespace slugs
