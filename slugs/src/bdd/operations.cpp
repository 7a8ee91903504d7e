// Each operation recurses on the topmost variable; all share one operation cache
// (Bryant 1986).  The relational product conjoins and quantifies in one pass,
// which avoids the often huge conjunction (Burch, Clarke and Long 1991).

#include "bdd/operations.hpp"

#include <algorithm>
#include <utility>

namespace slugs {

void Operations::order_changed() {
  cache_.clear();
  for (QuantifiedSet &set : sets_)
    find_last_level(set);
}

VarSet Operations::make_set(const std::vector<Var> &members) {
  QuantifiedSet set;
  set.contains.assign(table_.levels(), 0);
  for (const Var v : members) {
    assert(v < 2 * table_.bits());
    set.contains[v] = 1;
  }
  find_last_level(set);
  assert(set.empty == members.empty() && !set.contains.back());
  sets_.push_back(std::move(set));
  return static_cast<VarSet>(sets_.size() - 1);
}

void Operations::find_last_level(QuantifiedSet &set) const {
  set.last_level = 0;
  set.empty = true;
  for (Var v = 0; v + 1 < set.contains.size(); ++v)
    if (set.contains[v]) {
      set.empty = false;
      set.last_level = std::max(set.last_level, table_.level_of(v));
    }
  assert(set.empty || set.contains[table_.var_at(set.last_level)]);
}

void Operations::sweep() {
  const auto dead = [this](Edge f) { return (f >> 1) && !table_.marked(f >> 1); };
  cache_.forget(dead);
  table_.sweep();
}

// Look up a result and return whether it is cached.  A miss counts as a step of work.
inline bool Operations::find_or_count_step(Operation op, Edge f, Edge g, Edge h, Edge &result) {
  if (cache_.find(op, f, g, h, result)) {
    assert(table_.alive(result)); // else a sweep did not remove it
    return true;
  }
  if ((++work_ & 0x3FFF) == 0) {
    table_.account().budget().check();
    if (work_ > work_limit)
      throw WorkLimitReached();
    if (work_ > most_operation_work)
      throw OperationAborted();
  }
  return false;
}

Edge Operations::conjunction(Edge f, Edge g) {
  if (f == g)
    return f;
  if ((f ^ g) == 1 || f == bdd_false || g == bdd_false)
    return bdd_false;
  if (f == bdd_true)
    return g;
  if (g == bdd_true)
    return f;
  if (f > g)
    std::swap(f, g);
  assert(f > 1 && f < g && (f ^ g) != 1);
  Edge result;
  if (find_or_count_step(Operation::And, f, g, 0, result))
    return result;
  const UniqueTable::Node &fn = table_.node_of(f), &gn = table_.node_of(g);
  const std::uint32_t fl = table_.level_of(fn.var), gl = table_.level_of(gn.var);
  const Var v = fl <= gl ? fn.var : gn.var;
  const Edge f0 = fl <= gl ? fn.low ^ (f & 1) : f, f1 = fl <= gl ? fn.high ^ (f & 1) : f;
  const Edge g0 = gl <= fl ? gn.low ^ (g & 1) : g, g1 = gl <= fl ? gn.high ^ (g & 1) : g;
  const Edge r0 = conjunction(f0, g0);
  const Edge r1 = conjunction(f1, g1);
  result = table_.make(v, r0, r1);
  assert(table_.level(result) >= std::min(table_.level(f), table_.level(g)));
  cache_.add(Operation::And, f, g, 0, result);
  return result;
}

Edge Operations::exclusive_or(Edge f, Edge g) {
  const Edge complement = (f ^ g) & 1;
  f &= ~1u;
  g &= ~1u;
  if (f == g)
    return complement;
  if (f > g)
    std::swap(f, g);
  if (f == bdd_false)
    return g ^ complement;
  assert(f > 1 && f < g && f % 2 == 0 && g % 2 == 0);
  Edge result;
  if (find_or_count_step(Operation::Xor, f, g, 0, result))
    return result ^ complement;
  const UniqueTable::Node &fn = table_.node_of(f), &gn = table_.node_of(g);
  const std::uint32_t fl = table_.level_of(fn.var), gl = table_.level_of(gn.var);
  const Var v = fl <= gl ? fn.var : gn.var;
  const Edge f0 = fl <= gl ? fn.low : f, f1 = fl <= gl ? fn.high : f;
  const Edge g0 = gl <= fl ? gn.low : g, g1 = gl <= fl ? gn.high : g;
  const Edge r0 = exclusive_or(f0, g0);
  const Edge r1 = exclusive_or(f1, g1);
  result = table_.make(v, r0, r1);
  assert(result != bdd_false && table_.level(result) >= std::min(table_.level(f), table_.level(g)));
  cache_.add(Operation::Xor, f, g, 0, result);
  return result ^ complement;
}

Edge Operations::ite(Edge f, Edge g, Edge h) {
  if (f <= 1)
    return f == bdd_true ? g : h;
  if (g == h)
    return g;
  if (f & 1) {
    f ^= 1;
    std::swap(g, h);
  }
  if (g == bdd_true || g == f)
    return disjunction(f, h);
  if (g == bdd_false || g == (f ^ 1))
    return conjunction(f ^ 1, h);
  if (h == bdd_false || h == f)
    return conjunction(f, g);
  if (h == bdd_true || h == (f ^ 1))
    return disjunction(f ^ 1, g);
  if (g == (h ^ 1))
    return exclusive_or(f, h);
  const Edge complement = g & 1;
  g ^= complement;
  h ^= complement;
  assert(f % 2 == 0 && g % 2 == 0 && f > 1 && g > 1 && h > 1);
  Edge result;
  if (find_or_count_step(Operation::Ite, f, g, h, result))
    return result ^ complement;
  const std::uint32_t l = std::min({table_.level(f), table_.level(g), table_.level(h)});
  const auto child = [this, l](Edge e, bool high) {
    return table_.level(e) != l ? e : high ? table_.high_of(e) : table_.low_of(e);
  };
  const Edge f0 = child(f, false), f1 = child(f, true), g0 = child(g, false), g1 = child(g, true);
  const Edge h0 = child(h, false), h1 = child(h, true);
  assert(table_.var_at(l) == table_.var_of(f) || table_.level(f) > l);
  const Edge r0 = ite(f0, g0, h0);
  const Edge r1 = ite(f1, g1, h1);
  result = table_.make(table_.var_at(l), r0, r1);
  assert(table_.level(result) >= l);
  cache_.add(Operation::Ite, f, g, h, result);
  return result ^ complement;
}

Edge Operations::exists(Edge f, VarSet set) {
  assert(!is_empty(set));
  if (table_.level(f) > sets_[set].last_level)
    return f;
  Edge result;
  if (find_or_count_step(Operation::Exists, f, set, 0, result))
    return result;
  const Var v = table_.node_of(f).var;
  const Edge f0 = table_.low_of(f), f1 = table_.high_of(f);
  const Edge r0 = exists(f0, set);
  if (sets_[set].contains[v]) {
    result = r0 == bdd_true ? bdd_true : disjunction(r0, exists(f1, set));
  } else {
    const Edge r1 = exists(f1, set);
    result = table_.make(v, r0, r1);
  }
  assert(is_free_of(result, set) && table_.level(result) >= table_.level(f));
  cache_.add(Operation::Exists, f, set, 0, result);
  return result;
}

Edge Operations::and_exists(Edge f, Edge g, VarSet set) {
  assert(set < sets_.size());
  if (f == bdd_false || g == bdd_false || (f ^ g) == 1)
    return bdd_false;
  if (f == g || g == bdd_true)
    return exists(f, set);
  if (f == bdd_true)
    return exists(g, set);
  const std::uint32_t fl = table_.level(f), gl = table_.level(g);
  const std::uint32_t l = std::min(fl, gl);
  if (l > sets_[set].last_level)
    return conjunction(f, g);
  if (f > g)
    return and_exists(g, f, set);
  Edge result;
  if (find_or_count_step(Operation::AndExists, f, g, set, result))
    return result;
  const Edge f0 = fl == l ? table_.low_of(f) : f, f1 = fl == l ? table_.high_of(f) : f;
  const Edge g0 = gl == l ? table_.low_of(g) : g, g1 = gl == l ? table_.high_of(g) : g;
  const Var v = table_.var_at(l);
  const Edge r0 = and_exists(f0, g0, set);
  if (sets_[set].contains[v]) {
    // If r0 is f1 (or g1), it does not depend on the set and contains the high branch.
    if (r0 == bdd_true || r0 == f1 || r0 == g1)
      result = r0;
    else
      result = disjunction(r0, and_exists(f1, g1, set));
  } else {
    const Edge r1 = and_exists(f1, g1, set);
    result = table_.make(v, r0, r1);
  }
  assert(is_free_of(result, set) && table_.level(result) >= l);
  cache_.add(Operation::AndExists, f, g, set, result);
  return result;
}

// The cache key of three operands has no room for the set, so the cache holds the
// results of one set at a time.
void Operations::select_minus_set(VarSet set) {
  assert(set < sets_.size());
  if (minus_set_ == set)
    return;
  clear_cache();
  minus_set_ = set;
}

// If the top variable is quantified, the high branches of g and h are evaluated only
// on the part of f that remains after the low branches.
Edge Operations::minus_and_exists(Edge f, Edge g, Edge h, VarSet set) {
  assert(set == minus_set_ && is_free_of(f, set));
  if (f == bdd_false)
    return bdd_false;
  if (g == bdd_false || h == bdd_false || (g ^ h) == 1)
    return f;
  if (f == bdd_true)
    return and_exists(g, h, set) ^ 1;
  if (g == h || h == bdd_true)
    return conjunction(f, exists(g, set) ^ 1);
  if (g == bdd_true)
    return conjunction(f, exists(h, set) ^ 1);
  const std::uint32_t fl = table_.level(f), gl = table_.level(g), hl = table_.level(h);
  if (std::min(gl, hl) > sets_[set].last_level)
    return conjunction(f, conjunction(g, h) ^ 1);
  if (g > h)
    return minus_and_exists(f, h, g, set);
  Edge result;
  if (find_or_count_step(Operation::MinusAndExists, f, g, h, result))
    return result;
  const std::uint32_t l = std::min({fl, gl, hl});
  const Edge g0 = gl == l ? table_.low_of(g) : g, g1 = gl == l ? table_.high_of(g) : g;
  const Edge h0 = hl == l ? table_.low_of(h) : h, h1 = hl == l ? table_.high_of(h) : h;
  const Var v = table_.var_at(l);
  if (sets_[set].contains[v]) {
    assert(fl > l);
    const Edge left = minus_and_exists(f, g0, h0, set);
    result = minus_and_exists(left, g1, h1, set);
  } else {
    const Edge f0 = fl == l ? table_.low_of(f) : f, f1 = fl == l ? table_.high_of(f) : f;
    const Edge r0 = minus_and_exists(f0, g0, h0, set);
    const Edge r1 = minus_and_exists(f1, g1, h1, set);
    result = table_.make(v, r0, r1);
  }
  assert(is_free_of(result, set) && table_.level(result) >= l);
  cache_.add(Operation::MinusAndExists, f, g, h, result);
  return result;
}

Edge Operations::shift(Edge f, Direction direction) {
  if (f <= 1)
    return f;
  const Edge complement = f & 1;
  f ^= complement;
  Edge result;
  if (find_or_count_step(Operation::Shift, f, direction, 0, result))
    return result ^ complement;
  const UniqueTable::Node &n = table_.node_of(f);
  const Var v = n.var;
  // In a function of both copies, renaming would merge the two variables of a pair.
  assert(v % 2 == (direction == ToNext ? 0 : 1));
  const Edge f0 = n.low, f1 = n.high;
  const Edge r0 = shift(f0, direction);
  const Edge r1 = shift(f1, direction);
  result = table_.make(v ^ 1, r0, r1);
  assert(table_.var_of(result) == (v ^ 1)); // the shape is kept
  cache_.add(Operation::Shift, f, direction, 0, result);
  return result ^ complement;
}

Edge Operations::simplify(Edge f, Edge care) {
  assert(care != bdd_false);
  if (f <= 1 || care == bdd_true)
    return f;
  if (f == care)
    return bdd_true;
  if (f == (care ^ 1))
    return bdd_false;
  const Edge complement = f & 1;
  f ^= complement;
  Edge result;
  if (find_or_count_step(Operation::Simplify, f, care, 0, result))
    return result ^ complement;
  const std::uint32_t fl = table_.level(f), cl = table_.level(care);
  if (cl < fl) {
    assert(!is_terminal(care));
    result = simplify(f, disjunction(table_.low_of(care), table_.high_of(care)));
  } else {
    const Var v = table_.node_of(f).var;
    const Edge f0 = table_.low_of(f), f1 = table_.high_of(f);
    assert(care > 1);
    const Edge c0 = cl == fl ? table_.low_of(care) : care, c1 = cl == fl ? table_.high_of(care) : care;
    if (c0 == bdd_false) {
      result = simplify(f1, c1);
    } else if (c1 == bdd_false) {
      result = simplify(f0, c0);
    } else {
      const Edge r0 = simplify(f0, c0);
      const Edge r1 = simplify(f1, c1);
      result = table_.make(v, r0, r1);
    }
  }
  assert(table_.level(result) >= fl); // no variable is added at the top
  cache_.add(Operation::Simplify, f, care, 0, result);
  return result ^ complement;
}

Edge Operations::cofactor(Edge f, Var v, bool value) {
  assert(table_.alive(f));
  const std::uint32_t l = table_.level_of(v);
  if (table_.level(f) > l)
    return f;
  if (table_.level(f) == l)
    return value ? table_.high_of(f) : table_.low_of(f);
  // Restrict to a literal as the care set, which shares the cache with simplify().
  const Edge literal = table_.make(v, bdd_false, bdd_true);
  assert(table_.level(literal) == l);
  return simplify(f, value ? literal : literal ^ 1);
}

Edge Operations::branch(Var v, Edge low, Edge high) {
  assert(table_.alive(low) && table_.alive(high));
  const std::uint32_t l = table_.level_of(v);
  if (l < table_.level(low) && l < table_.level(high))
    return table_.make(v, low, high);
  return ite(table_.make(v, bdd_false, bdd_true), high, low);
}

} // namespace slugs
