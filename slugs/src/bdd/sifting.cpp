// Exchanging two adjacent levels rewrites only those nodes of the upper level
// that have a child on the lower one, and every edge keeps its function.  Four such
// exchanges swap two adjacent pairs (x, x').  Each pair moves to the nearer end of
// the order, then to the other end, then to the position of the smallest size.
//
// Reference counts exist only during sifting, which needs the exact size after each
// exchange.

#include "bdd/reordering.hpp"

#include <algorithm>
#include <cassert>

namespace slugs {

class Sifting {
public:
  Sifting(BddStore &store, double growth)
      : store_(store), table_(store.operations_.table()), growth_(growth), references_(store.account_),
        nodes_of_(table_.levels()) {}

  static bool has_room(BddStore &store) {
    return store.account_.has_room(store.operations_.table().capacity() * sizeof(std::uint32_t));
  }

  enum class Roots { Handles, All };

  void run(SiftingLog &log, Roots roots, std::uint64_t budget) {
    prepare(roots);
    std::vector<std::uint32_t> bits(table_.bits());
    for (std::uint32_t b = 0; b < bits.size(); ++b)
      bits[b] = b;
    std::vector<std::size_t> weight(bits.size());
    for (const std::uint32_t b : bits)
      weight[b] = nodes_of_[current_var(b)].size() + nodes_of_[next_var(b)].size();
    std::stable_sort(bits.begin(), bits.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return weight[a] > weight[b]; });
    assert(growth_ >= 1);
    std::uint64_t start = store_.sifting_work_;
    std::size_t nodes = table_.live_;
    for (const std::uint32_t b : bits) {
      if (weight[b] == 0 || store_.sifting_work_ - start > budget)
        break;
      const std::uint32_t from = table_.level_of_var_[current_var(b)] / 2;
      [[maybe_unused]] const std::size_t before = table_.live_;
      place(b);
      assert(table_.live_ <= before);
      if (table_.level_of_var_[current_var(b)] / 2 != from)
        log.push_back({b, from});
      if (table_.live_ < nodes / 2) {
        nodes = table_.live_;
        start = store_.sifting_work_;
      }
    }
    store_.order_changed();
    ++store_.reorderings_;
    if (roots == Roots::All)
      store_.collect();
  }

  void undo(const SiftingLog &log) {
    prepare(Roots::Handles);
    for (std::size_t i = log.size(); i-- > 0;) {
      std::uint32_t at = table_.level_of_var_[current_var(log[i].bit)] / 2;
      for (; at < log[i].from; ++at)
        exchange_pairs(at);
      for (; at > log[i].from; --at)
        exchange_pairs(at - 1);
      assert(table_.var_at_level_[2 * log[i].from] == current_var(log[i].bit));
    }
    store_.order_changed();
  }

private:
  // Count references.  Nodes that no handle reaches are collected (Roots::Handles), or
  // protected by a reference of their own (Roots::All).
  void prepare(Roots roots) {
    assert(store_.collection_allowed_); // users of edges without handles rely on the order
    if (roots == Roots::Handles)
      store_.collect();
    table_.clear_marks();
    references_.resize_for(table_.nodes_.size());
    for (std::uint32_t n = 1; n < table_.used_; ++n) {
      const UniqueTable::Node &node = table_.nodes_[n];
      if (node.var == UniqueTable::free_var)
        continue;
      references_.add(node.low);
      references_.add(node.high);
      assert(node.var < 2 * table_.bits());
      nodes_of_[node.var].push_back(n);
    }
    for (const Bdd *h = store_.handles_; h; h = h->after_)
      references_.add(h->edge_); // of handles
    if (roots == Roots::All)
      for (std::uint32_t n = 1; n < table_.used_; ++n)
        if (!references_.has_any(n << 1) && table_.nodes_[n].var != UniqueTable::free_var)
          references_.add(n << 1);
  }

  void place(std::uint32_t bit) {
    const std::uint32_t last = table_.bits() - 1;
    std::uint32_t at = table_.level_of_var_[current_var(bit)] / 2;
    std::uint32_t best_at = at;
    std::size_t best = table_.live_;
    const std::uint32_t start = at;
    const auto travel = [&](bool down) {
      while (down ? at < last : at > 0) {
        exchange_pairs(down ? at : at - 1);
        at = down ? at + 1 : at - 1;
        if (down ? at <= start : at >= start)
          continue; // returning through positions already measured
        if (table_.live_ < best) {
          best = table_.live_;
          best_at = at;
        }
        if (static_cast<double>(table_.live_) > growth_ * static_cast<double>(best))
          break;
      }
    };
    assert(at <= last && table_.var_at_level_[2 * at] == current_var(bit));
    const bool down_first = at > last / 2;
    travel(down_first);
    travel(!down_first);
    for (; at < best_at; ++at)
      exchange_pairs(at);
    for (; at > best_at; --at)
      exchange_pairs(at - 1);
    // In one order, functions have one reduced form.
    assert(at == best_at && table_.live_ == best);
  }

  // Positions p and p + 1: a a' b b' becomes b b' a a'.
  void exchange_pairs(std::uint32_t p) {
    assert(p + 1 < table_.bits());
    store_.account_.budget().check();
    exchange(2 * p + 1);
    exchange(2 * p);
    exchange(2 * p + 2);
    exchange(2 * p + 1);
    // to_next relies on each current variable being directly above its next variable.
    assert(table_.var_at_level_[2 * p + 1] == (table_.var_at_level_[2 * p] | 1) &&
           table_.var_at_level_[2 * p + 3] == (table_.var_at_level_[2 * p + 2] | 1));
  }

  void exchange(std::uint32_t l) {
    assert(l + 2 < table_.levels()); // never the level of the constant
    const Var upper = table_.var_at_level_[l], lower = table_.var_at_level_[l + 1];
    std::swap(table_.var_at_level_[l], table_.var_at_level_[l + 1]);
    table_.level_of_var_[upper] = l + 1;
    table_.level_of_var_[lower] = l;
    std::vector<std::uint32_t> &uppers = nodes_of_[upper];
    store_.sifting_work_ += uppers.size() + 1; // an empty level also counts
    moved_.clear();
    std::size_t kept = 0;
    for (const std::uint32_t n : uppers) {
      const UniqueTable::Node &node = table_.nodes_[n];
      // The list may contain freed nodes, and reused nodes twice.
      if (node.var != upper || table_.marked(n))
        continue;
      table_.set_mark(n);
      assert(references_.has_any(n << 1)); // without references it would be free
      if (table_.nodes_[node.low >> 1].var == lower || table_.nodes_[node.high >> 1].var == lower)
        moved_.push_back(n);
      else
        uppers[kept++] = n;
    }
    uppers.resize(kept);
    for (const std::uint32_t n : uppers)
      table_.marks_[n >> 5] = 0;
    for (const std::uint32_t n : moved_) {
      table_.marks_[n >> 5] = 0;
      unchain(n);
      // Keep the node out of the table until it is rewritten, even if the table grows.
      table_.nodes_[n].var = UniqueTable::free_var;
    }
    for (const std::uint32_t n : moved_)
      rewrite(n, upper, lower);
  }

  void rewrite(std::uint32_t n, Var upper, Var lower) {
    const Edge low = table_.nodes_[n].low, high = table_.nodes_[n].high;
    assert((low & 1) == 0);
    const bool low_splits = table_.nodes_[low >> 1].var == lower,
               high_splits = table_.nodes_[high >> 1].var == lower;
    const Edge f00 = low_splits ? table_.low_of(low) : low, f01 = low_splits ? table_.high_of(low) : low;
    const Edge f10 = high_splits ? table_.low_of(high) : high,
               f11 = high_splits ? table_.high_of(high) : high;
    const Edge new_low = child(upper, f00, f10);
    const Edge new_high = child(upper, f01, f11);
    assert((new_low & 1) == 0 && new_low != new_high);
    UniqueTable::Node &node = table_.nodes_[n];
    assert(node.var == UniqueTable::free_var);
    const std::size_t b = table_.bucket(lower, new_low, new_high);
    node = {new_low, new_high, table_.buckets_[b], lower};
    table_.buckets_[b] = n;
    nodes_of_[lower].push_back(n);
    release(low);
    release(high);
  }

  // Return the node "if v then high else low" and add a reference to it.
  Edge child(Var v, Edge low, Edge high) {
    const std::size_t before = table_.live_;
    const Edge e = table_.make(v, low, high);
    if (table_.live_ != before) {
      references_.resize_for(table_.nodes_.size());
      assert(!references_.has_any(e));
      references_.add(low);
      references_.add(high);
      nodes_of_[v].push_back(e >> 1);
    }
    references_.add(e);
    assert(table_.alive(e));
    return e;
  }

  void release(Edge e) {
    const std::uint32_t n = e >> 1;
    if (!references_.remove(e) || n == 0)
      return;
    const Edge low = table_.nodes_[n].low, high = table_.nodes_[n].high;
    unchain(n);
    table_.free_node(n);
    assert(table_.live_ > 0);
    --table_.live_;
    release(low);
    release(high);
  }

  void unchain(std::uint32_t n) {
    const UniqueTable::Node &node = table_.nodes_[n];
    std::uint32_t *link = &table_.buckets_[table_.bucket(node.var, node.low, node.high)];
    while (*link != n) {
      assert(*link != 0); // the node is in its chain
      link = &table_.nodes_[*link].chain;
    }
    *link = node.chain;
  }

  BddStore &store_;
  UniqueTable &table_;
  double growth_;
  References references_;
  std::vector<std::vector<std::uint32_t>> nodes_of_; // indexed by variable; may contain freed nodes
  std::vector<std::uint32_t> moved_;
};

void sift(BddStore &store, SiftingLog &log, double growth, std::uint64_t budget) {
  if (Sifting::has_room(store))
    Sifting(store, growth).run(log, Sifting::Roots::Handles, budget);
}

void sift_all(BddStore &store, SiftingLog &log, double growth, std::uint64_t budget) {
  if (Sifting::has_room(store))
    Sifting(store, growth).run(log, Sifting::Roots::All, budget);
}

void undo_sifting(BddStore &store, const SiftingLog &log) {
  if (Sifting::has_room(store))
    Sifting(store, 1.0).undo(log);
}

} // namespace slugs
