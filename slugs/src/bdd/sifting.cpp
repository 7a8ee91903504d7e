// Reordering in place by sifting (Rudell 1993), a pair of variables at a time.
//
// Exchanging two adjacent levels rewrites only those nodes of the upper level
// that have a child on the lower one, and keeps what every edge means.  A pair
// (x, x') passes another one by four such exchanges.  Each pair travels to the
// nearer end, then to the other end, then to where the diagrams were smallest.
//
// Only while sifting do nodes carry reference counts: the size of the diagrams
// after each exchange has to be exact.

#include "bdd/bdd.hpp"

#include <algorithm>
#include <cassert>

namespace slugs {

class Sifting {
public:
  Sifting(BddStore &store, double growth)
      : s_(store), growth_(growth), references_(store.account_), nodes_of_(store.level_of_var_.size()) {}

  enum class Roots { Handles, All };

  void run(SiftingLog &log, Roots roots, std::uint64_t budget) {
    prepare(roots);
    std::vector<std::uint32_t> bits(s_.bits());
    for (std::uint32_t b = 0; b < bits.size(); ++b)
      bits[b] = b;
    std::vector<std::size_t> weight(bits.size());
    for (const std::uint32_t b : bits)
      weight[b] = nodes_of_[current_var(b)].size() + nodes_of_[next_var(b)].size();
    std::stable_sort(bits.begin(), bits.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return weight[a] > weight[b]; });
    std::uint64_t start = s_.sifting_work_;
    std::size_t nodes = s_.live_;
    for (const std::uint32_t b : bits) {
      if (weight[b] == 0 || s_.sifting_work_ - start > budget)
        break;
      const std::uint32_t from = s_.level_of_var_[current_var(b)] / 2;
      place(b);
      if (s_.level_of_var_[current_var(b)] / 2 != from)
        log.push_back({b, from});
      if (s_.live_ < nodes / 2) {
        nodes = s_.live_;
        start = s_.sifting_work_;
      }
    }
  }

  void undo(const SiftingLog &log) {
    prepare(Roots::Handles);
    for (std::size_t i = log.size(); i-- > 0;) {
      std::uint32_t at = s_.level_of_var_[current_var(log[i].bit)] / 2;
      for (; at < log[i].from; ++at)
        exchange_pairs(at);
      for (; at > log[i].from; --at)
        exchange_pairs(at - 1);
    }
  }

private:
  // Counts references.  Drops what no handle reaches, or holds it for itself.
  void prepare(Roots roots) {
    assert(s_.collection_allowed_); // whoever holds edges without handles relies on the order
    if (roots == Roots::Handles)
      s_.collect();
    s_.clear_marks();
    references_.resize(s_.nodes_.size());
    for (std::uint32_t n = 1; n < s_.used_; ++n) {
      const BddStore::Node &node = s_.nodes_[n];
      if (node.var == BddStore::free_var)
        continue;
      ++references_[node.low >> 1];
      ++references_[node.high >> 1];
      nodes_of_[node.var].push_back(n);
    }
    for (const Bdd *h = s_.handles_; h; h = h->after_)
      ++references_[h->edge_ >> 1];
    if (roots == Roots::All)
      for (std::uint32_t n = 1; n < s_.used_; ++n)
        if (!references_[n] && s_.nodes_[n].var != BddStore::free_var)
          references_[n] = 1;
  }

  void place(std::uint32_t bit) {
    const std::uint32_t last = s_.bits() - 1;
    std::uint32_t at = s_.level_of_var_[current_var(bit)] / 2;
    std::uint32_t best_at = at;
    std::size_t best = s_.live_;
    const std::uint32_t start = at;
    const auto travel = [&](bool down) {
      while (down ? at < last : at > 0) {
        exchange_pairs(down ? at : at - 1);
        at = down ? at + 1 : at - 1;
        if (down ? at <= start : at >= start)
          continue; // on the way back, where it has been before
        if (s_.live_ < best) {
          best = s_.live_;
          best_at = at;
        }
        if (static_cast<double>(s_.live_) > growth_ * static_cast<double>(best))
          break;
      }
    };
    const bool down_first = at > last / 2;
    travel(down_first);
    travel(!down_first);
    for (; at < best_at; ++at)
      exchange_pairs(at);
    for (; at > best_at; --at)
      exchange_pairs(at - 1);
  }

  // Positions p and p + 1: a a' b b' becomes b b' a a'.
  void exchange_pairs(std::uint32_t p) {
    s_.check_budget();
    exchange(2 * p + 1);
    exchange(2 * p);
    exchange(2 * p + 2);
    exchange(2 * p + 1);
    // A current variable is right above its next one: to_next relabels.
    assert(s_.var_at_level_[2 * p + 1] == (s_.var_at_level_[2 * p] | 1) &&
           s_.var_at_level_[2 * p + 3] == (s_.var_at_level_[2 * p + 2] | 1));
  }

  void exchange(std::uint32_t l) {
    const Var upper = s_.var_at_level_[l], lower = s_.var_at_level_[l + 1];
    std::swap(s_.var_at_level_[l], s_.var_at_level_[l + 1]);
    s_.level_of_var_[upper] = l + 1;
    s_.level_of_var_[lower] = l;
    std::vector<std::uint32_t> &uppers = nodes_of_[upper];
    s_.sifting_work_ += uppers.size() + 1; // an empty level is a step, too
    moved_.clear();
    std::size_t kept = 0;
    for (const std::uint32_t n : uppers) {
      const BddStore::Node &node = s_.nodes_[n];
      // A list may name nodes that died, and twice those that came back.
      if (node.var != upper || s_.marked(n))
        continue;
      s_.set_mark(n);
      if (s_.nodes_[node.low >> 1].var == lower || s_.nodes_[node.high >> 1].var == lower)
        moved_.push_back(n);
      else
        uppers[kept++] = n;
    }
    uppers.resize(kept);
    for (const std::uint32_t n : uppers)
      s_.marks_[n >> 5] = 0;
    for (const std::uint32_t n : moved_) {
      s_.marks_[n >> 5] = 0;
      unchain(n);
      // Outside the table until rewritten, also if the table grows meanwhile.
      s_.nodes_[n].var = BddStore::free_var;
    }
    for (const std::uint32_t n : moved_)
      rewrite(n, upper, lower);
  }

  void rewrite(std::uint32_t n, Var upper, Var lower) {
    const Edge low = s_.nodes_[n].low, high = s_.nodes_[n].high;
    const bool low_splits = s_.nodes_[low >> 1].var == lower, high_splits = s_.nodes_[high >> 1].var == lower;
    const Edge f00 = low_splits ? s_.low_of(low) : low, f01 = low_splits ? s_.high_of(low) : low;
    const Edge f10 = high_splits ? s_.low_of(high) : high, f11 = high_splits ? s_.high_of(high) : high;
    const Edge new_low = child(upper, f00, f10);
    const Edge new_high = child(upper, f01, f11);
    BddStore::Node &node = s_.nodes_[n];
    const std::size_t b = s_.bucket(lower, new_low, new_high);
    node = {new_low, new_high, s_.buckets_[b], lower};
    s_.buckets_[b] = n;
    nodes_of_[lower].push_back(n);
    release(low);
    release(high);
  }

  // The node "if v then high else low", with one more reference.
  Edge child(Var v, Edge low, Edge high) {
    const std::size_t before = s_.live_;
    const Edge e = s_.make(v, low, high);
    const std::uint32_t n = e >> 1;
    if (n >= references_.size())
      references_.resize(s_.nodes_.size());
    if (s_.live_ != before) {
      references_[n] = 0;
      ++references_[low >> 1];
      ++references_[high >> 1];
      nodes_of_[v].push_back(n);
    }
    ++references_[n];
    return e;
  }

  void release(Edge e) {
    const std::uint32_t n = e >> 1;
    assert(references_[n] > 0); // else sifting has lost an edge
    if (--references_[n] || n == 0)
      return;
    const Edge low = s_.nodes_[n].low, high = s_.nodes_[n].high;
    unchain(n);
    s_.nodes_[n] = {0, 0, s_.free_list_, BddStore::free_var};
    s_.free_list_ = n;
    --s_.live_;
    release(low);
    release(high);
  }

  void unchain(std::uint32_t n) {
    const BddStore::Node &node = s_.nodes_[n];
    std::uint32_t *link = &s_.buckets_[s_.bucket(node.var, node.low, node.high)];
    while (*link != n)
      link = &s_.nodes_[*link].chain;
    *link = node.chain;
  }

  BddStore &s_;
  double growth_;
  CountedArray<std::uint32_t> references_;
  std::vector<std::vector<std::uint32_t>> nodes_of_; // by variable; may name nodes that died since
  std::vector<std::uint32_t> moved_;
};

void BddStore::sift(SiftingLog &log, double growth, std::uint64_t budget) {
  if (!account_.has_room(nodes_.size() * sizeof(std::uint32_t)))
    return;
  Sifting(*this, growth).run(log, Sifting::Roots::Handles, budget);
  after_sifting();
  ++reorderings_;
}

void BddStore::sift_all(SiftingLog &log, double growth, std::uint64_t budget) {
  if (!account_.has_room(nodes_.size() * sizeof(std::uint32_t)))
    return;
  Sifting(*this, growth).run(log, Sifting::Roots::All, budget);
  after_sifting();
  collect();
  ++reorderings_;
}

void BddStore::undo(const SiftingLog &log) {
  if (!account_.has_room(nodes_.size() * sizeof(std::uint32_t)))
    return;
  Sifting(*this, 1.0).undo(log);
  after_sifting();
}

void BddStore::after_sifting() {
#ifndef NDEBUG
  assert_consistent();
#endif
  cache_.clear_to_zero();
  order_changed();
  collected_ = live_;
  plan_collection();
}

} // namespace slugs
