// The operations on diagrams: each a recursion on the topmost variable with one
// shared cache (Bryant 1986).  The relational product conjoins and quantifies in
// one pass, which avoids the often huge conjunction (Burch, Clarke and Long
// 1991).

#include "bdd/bdd.hpp"

#include "core/hash.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

namespace slugs {

BddStore::CacheEntry &BddStore::cache_slot(std::uint32_t f, std::uint32_t g, std::uint32_t h) {
  std::uint64_t x = (std::uint64_t{f} << 32 | g) * golden_multiplier;
  x ^= x >> 32;
  x = (x + h) * second_multiplier;
  return cache_[static_cast<std::size_t>(x >> 32) & (cache_.size() - 1)];
}

// Whether the result is known.  If not, whoever asks computes it: a step of work.
inline bool BddStore::known_or_step(Operation op, Edge f, Edge g, Edge h, Edge &result) {
  const std::uint32_t key = f | static_cast<std::uint32_t>(op) << operation_shift;
  const CacheEntry &entry = cache_slot(key, g, h);
  if (entry.f_and_operation == key && entry.g == g && entry.h == h) {
    result = entry.result;
    return true;
  }
  if ((++work_ & 0x3FFF) == 0) {
    check_budget();
    if (work_ > most_work_)
      throw Overworked();
    if (work_ > most_operation_work_)
      throw Outgrown();
  }
  return false;
}

inline void BddStore::remember(Operation op, Edge f, Edge g, Edge h, Edge result) {
  const std::uint32_t key = f | static_cast<std::uint32_t>(op) << operation_shift;
  cache_slot(key, g, h) = {key, g, h, result};
}

void BddStore::resize_cache() {
  // As many entries as nodes while both fit a processor's caches, then a quarter:
  // a larger table finds little more and costs a memory access for each look.
  constexpr std::size_t near = 1u << 18, largest = 1u << 21;
  const std::size_t wanted = std::min(std::max(std::min(nodes_.size(), near), nodes_.size() / 4), largest);
  const std::size_t old = cache_.size();
  std::size_t size = old;
  while (size < wanted)
    size *= 2;
  if (size == old || !account_.has_room((size - old) * sizeof(CacheEntry)))
    return;
  cache_.resize(size);
  // Entries move up by a multiple of the old size, or stay.
  for (std::size_t i = 0; i < old; ++i) {
    const CacheEntry entry = cache_[i];
    CacheEntry &slot = cache_slot(entry.f_and_operation, entry.g, entry.h);
    if (!entry.f_and_operation || &slot == &cache_[i])
      continue;
    slot = entry;
    cache_[i] = {};
  }
}

Edge BddStore::and_(Edge f, Edge g) {
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
  Edge result;
  if (known_or_step(And, f, g, 0, result))
    return result;
  const Node &fn = nodes_[f >> 1], &gn = nodes_[g >> 1];
  const std::uint32_t fl = level_of_var_[fn.var], gl = level_of_var_[gn.var];
  const Var v = fl <= gl ? fn.var : gn.var;
  const Edge f0 = fl <= gl ? fn.low ^ (f & 1) : f, f1 = fl <= gl ? fn.high ^ (f & 1) : f;
  const Edge g0 = gl <= fl ? gn.low ^ (g & 1) : g, g1 = gl <= fl ? gn.high ^ (g & 1) : g;
  const Edge r0 = and_(f0, g0);
  const Edge r1 = and_(f1, g1);
  result = make(v, r0, r1);
  remember(And, f, g, 0, result);
  return result;
}

Edge BddStore::xor_(Edge f, Edge g) {
  const Edge complement = (f ^ g) & 1;
  f &= ~1u;
  g &= ~1u;
  if (f == g)
    return complement;
  if (f > g)
    std::swap(f, g);
  if (f == bdd_false)
    return g ^ complement;
  Edge result;
  if (known_or_step(Xor, f, g, 0, result))
    return result ^ complement;
  const Node &fn = nodes_[f >> 1], &gn = nodes_[g >> 1];
  const std::uint32_t fl = level_of_var_[fn.var], gl = level_of_var_[gn.var];
  const Var v = fl <= gl ? fn.var : gn.var;
  const Edge f0 = fl <= gl ? fn.low : f, f1 = fl <= gl ? fn.high : f;
  const Edge g0 = gl <= fl ? gn.low : g, g1 = gl <= fl ? gn.high : g;
  const Edge r0 = xor_(f0, g0);
  const Edge r1 = xor_(f1, g1);
  result = make(v, r0, r1);
  remember(Xor, f, g, 0, result);
  return result ^ complement;
}

Edge BddStore::choice_(Edge f, Edge g, Edge h) {
  if (f <= 1)
    return f == bdd_true ? g : h;
  if (g == h)
    return g;
  if (f & 1) {
    f ^= 1;
    std::swap(g, h);
  }
  if (g == bdd_true || g == f)
    return or_(f, h);
  if (g == bdd_false || g == (f ^ 1))
    return and_(f ^ 1, h);
  if (h == bdd_false || h == f)
    return and_(f, g);
  if (h == bdd_true || h == (f ^ 1))
    return or_(f ^ 1, g);
  if (g == (h ^ 1))
    return xor_(f, h);
  const Edge complement = g & 1;
  g ^= complement;
  h ^= complement;
  Edge result;
  if (known_or_step(Choice, f, g, h, result))
    return result ^ complement;
  const std::uint32_t l = std::min({level(f), level(g), level(h)});
  const auto child = [this, l](Edge e, bool high) {
    return level(e) != l ? e : high ? high_of(e) : low_of(e);
  };
  const Edge f0 = child(f, false), f1 = child(f, true), g0 = child(g, false), g1 = child(g, true);
  const Edge h0 = child(h, false), h1 = child(h, true);
  const Edge r0 = choice_(f0, g0, h0);
  const Edge r1 = choice_(f1, g1, h1);
  result = make(var_at_level_[l], r0, r1);
  remember(Choice, f, g, h, result);
  return result ^ complement;
}

Edge BddStore::exists_(Edge f, VarSet set) {
  if (level(f) > sets_[set].last_level)
    return f;
  Edge result;
  if (known_or_step(Exists, f, set, 0, result))
    return result;
  const Var v = nodes_[f >> 1].var;
  const Edge f0 = low_of(f), f1 = high_of(f);
  const Edge r0 = exists_(f0, set);
  if (sets_[set].contains[v]) {
    result = r0 == bdd_true ? bdd_true : or_(r0, exists_(f1, set));
  } else {
    const Edge r1 = exists_(f1, set);
    result = make(v, r0, r1);
  }
  remember(Exists, f, set, 0, result);
  return result;
}

Edge BddStore::exists_both_(Edge f, Edge g, VarSet set) {
  if (f == bdd_false || g == bdd_false || (f ^ g) == 1)
    return bdd_false;
  if (f == g || g == bdd_true)
    return exists_(f, set);
  if (f == bdd_true)
    return exists_(g, set);
  const std::uint32_t fl = level(f), gl = level(g);
  const std::uint32_t l = std::min(fl, gl);
  if (l > sets_[set].last_level)
    return and_(f, g);
  if (f > g)
    return exists_both_(g, f, set);
  Edge result;
  if (known_or_step(ExistsBoth, f, g, set, result))
    return result;
  const Edge f0 = fl == l ? low_of(f) : f, f1 = fl == l ? high_of(f) : f;
  const Edge g0 = gl == l ? low_of(g) : g, g1 = gl == l ? high_of(g) : g;
  const Var v = var_at_level_[l];
  const Edge r0 = exists_both_(f0, g0, set);
  if (sets_[set].contains[v]) {
    // If r0 is f1, then f1 is free of the set, and contains whatever the high
    // branch adds.
    if (r0 == bdd_true || r0 == f1 || r0 == g1)
      result = r0;
    else
      result = or_(r0, exists_both_(f1, g1, set));
  } else {
    const Edge r1 = exists_both_(f1, g1, set);
    result = make(v, r0, r1);
  }
  remember(ExistsBoth, f, g, set, result);
  return result;
}

// Where g and h have a quantified variable on top, what their first halves leave of
// f is all that their second halves have to look at.
Edge BddStore::minus_exists_both_(Edge f, Edge g, Edge h, VarSet set) {
  if (f == bdd_false)
    return bdd_false;
  if (g == bdd_false || h == bdd_false || (g ^ h) == 1)
    return f;
  if (f == bdd_true)
    return exists_both_(g, h, set) ^ 1;
  if (g == h || h == bdd_true)
    return and_(f, exists_(g, set) ^ 1);
  if (g == bdd_true)
    return and_(f, exists_(h, set) ^ 1);
  const std::uint32_t fl = level(f), gl = level(g), hl = level(h);
  if (std::min(gl, hl) > sets_[set].last_level)
    return and_(f, and_(g, h) ^ 1);
  if (g > h)
    return minus_exists_both_(f, h, g, set);
  Edge result;
  if (known_or_step(MinusExistsBoth, f, g, h, result))
    return result;
  const std::uint32_t l = std::min({fl, gl, hl});
  const Edge g0 = gl == l ? low_of(g) : g, g1 = gl == l ? high_of(g) : g;
  const Edge h0 = hl == l ? low_of(h) : h, h1 = hl == l ? high_of(h) : h;
  const Var v = var_at_level_[l];
  if (sets_[set].contains[v]) {
    assert(fl > l);
    const Edge left = minus_exists_both_(f, g0, h0, set);
    result = minus_exists_both_(left, g1, h1, set);
  } else {
    const Edge f0 = fl == l ? low_of(f) : f, f1 = fl == l ? high_of(f) : f;
    const Edge r0 = minus_exists_both_(f0, g0, h0, set);
    const Edge r1 = minus_exists_both_(f1, g1, h1, set);
    result = make(v, r0, r1);
  }
  remember(MinusExistsBoth, f, g, h, result);
  return result;
}

Edge BddStore::shift_(Edge f, Direction direction) {
  if (f <= 1)
    return f;
  const Edge complement = f & 1;
  f ^= complement;
  Edge result;
  if (known_or_step(Shift, f, direction, 0, result))
    return result ^ complement;
  const Node &n = nodes_[f >> 1];
  const Var v = n.var;
  // A function of both copies would fold them into one.
  assert(v % 2 == (direction == ToNext ? 0 : 1));
  const Edge f0 = n.low, f1 = n.high;
  const Edge r0 = shift_(f0, direction);
  const Edge r1 = shift_(f1, direction);
  result = make(v ^ 1, r0, r1);
  remember(Shift, f, direction, 0, result);
  return result ^ complement;
}

Edge BddStore::simplify_(Edge f, Edge care) {
  if (f <= 1 || care == bdd_true)
    return f;
  if (f == care)
    return bdd_true;
  if (f == (care ^ 1))
    return bdd_false;
  const Edge complement = f & 1;
  f ^= complement;
  Edge result;
  if (known_or_step(Simplify, f, care, 0, result))
    return result ^ complement;
  const std::uint32_t fl = level(f), cl = level(care);
  if (cl < fl) {
    result = simplify_(f, or_(low_of(care), high_of(care)));
  } else {
    const Var v = nodes_[f >> 1].var;
    const Edge f0 = low_of(f), f1 = high_of(f);
    const Edge c0 = cl == fl ? low_of(care) : care, c1 = cl == fl ? high_of(care) : care;
    if (c0 == bdd_false) {
      result = simplify_(f1, c1);
    } else if (c1 == bdd_false) {
      result = simplify_(f0, c0);
    } else {
      const Edge r0 = simplify_(f0, c0);
      const Edge r1 = simplify_(f1, c1);
      result = make(v, r0, r1);
    }
  }
  remember(Simplify, f, care, 0, result);
  return result ^ complement;
}

Edge BddStore::cofactor_edge(Edge f, Var v, bool value) {
  assert(alive(f));
  const std::uint32_t l = level_of_var_[v];
  if (level(f) > l)
    return f;
  if (level(f) == l)
    return value ? high_of(f) : low_of(f);
  // As "restrict" with one literal as the care set, whose cache it shares.
  const Edge literal = make(v, bdd_false, bdd_true);
  return simplify_(f, value ? literal : literal ^ 1);
}

Edge BddStore::branch_edge(Var v, Edge low, Edge high) {
  const std::uint32_t l = level_of_var_[v];
  if (l < level(low) && l < level(high))
    return make(v, low, high);
  return choice_(make(v, bdd_false, bdd_true), high, low);
}

Bdd BddStore::conjunction(const Bdd &f, const Bdd &g) {
  return run([&] { return and_(f.edge(), g.edge()); });
}

Bdd BddStore::exclusive(const Bdd &f, const Bdd &g) {
  return run([&] { return xor_(f.edge(), g.edge()); });
}

Bdd BddStore::choice(const Bdd &f, const Bdd &g, const Bdd &h) {
  return run([&] { return choice_(f.edge(), g.edge(), h.edge()); });
}

Bdd BddStore::exists(const Bdd &f, VarSet set) {
  assert(set < sets_.size());
  return sets_[set].empty ? f : run([&] { return exists_(f.edge(), set); });
}

Bdd BddStore::forall(const Bdd &f, VarSet set) { return !exists(!f, set); }

Bdd BddStore::exists_both(const Bdd &f, const Bdd &g, VarSet set) {
  assert(set < sets_.size());
  return sets_[set].empty ? conjunction(f, g) : run([&] { return exists_both_(f.edge(), g.edge(), set); });
}

Bdd BddStore::minus_exists_both(const Bdd &f, const Bdd &g, const Bdd &h, VarSet set) {
  assert(set < sets_.size());
  if (sets_[set].empty)
    return conjunction(f, !conjunction(g, h));
  if (minus_set_ != set) { // three operands leave no room for the set in the key of a result
    clear_cache();
    minus_set_ = set;
  }
  return run([&] { return minus_exists_both_(f.edge(), g.edge(), h.edge(), set); });
}

Bdd BddStore::to_next(const Bdd &f) {
  return run([&] { return shift_(f.edge(), ToNext); });
}

Bdd BddStore::to_current(const Bdd &f) {
  return run([&] { return shift_(f.edge(), ToCurrent); });
}

Bdd BddStore::simplify(const Bdd &f, const Bdd &care) {
  assert(!care.is_false());
  return run([&] { return simplify_(f.edge(), care.edge()); });
}

bool BddStore::evaluate(Edge f, const std::vector<bool> &value_of_var) const {
  while (f > 1)
    f = value_of_var[var_of(f)] ? high_of(f) : low_of(f);
  return f == bdd_true;
}

std::vector<bool> BddStore::some_valuation(const Bdd &f) const {
  assert(!f.is_false());
  std::vector<bool> result(level_of_var_.size() - 1, false);
  for (Edge e = f.edge(); e > 1;) {
    const bool value = low_of(e) == bdd_false;
    result[var_of(e)] = value;
    e = value ? high_of(e) : low_of(e);
  }
  return result;
}

double BddStore::count(const Bdd &f, const std::vector<Var> &over) {
  // The fraction of valuations that satisfy, then scaled: no levels to count.
  // An edge and its complement are visited apart, because 1 - x would cancel.
  std::unordered_map<Edge, double> fraction{{bdd_false, 0.0}, {bdd_true, 1.0}};
  const auto visit = [&](const auto &self, Edge e) -> double {
    const auto known = fraction.find(e);
    if (known != fraction.end())
      return known->second;
    const double low = self(self, low_of(e));
    const double high = self(self, high_of(e));
    return fraction[e] = (low + high) / 2;
  };
  return std::ldexp(visit(visit, f.edge()), static_cast<int>(over.size()));
}

std::vector<Var> BddStore::support(const Bdd &f) {
  clear_marks();
  std::vector<std::uint8_t> seen(level_of_var_.size(), 0);
  const auto visit = [&](const auto &self, std::uint32_t n) -> void {
    if (!n || marked(n))
      return;
    set_mark(n);
    seen[nodes_[n].var] = 1;
    self(self, nodes_[n].low >> 1);
    self(self, nodes_[n].high >> 1);
  };
  visit(visit, f.edge() >> 1);
  std::vector<Var> result;
  for (Var v = 0; v < seen.size(); ++v)
    if (seen[v])
      result.push_back(v);
  return result;
}

std::size_t BddStore::size(const Bdd &f) {
  clear_marks();
  mark(f.edge());
  std::size_t count = 0;
  for (std::size_t w = 0; w < marks_.size(); ++w)
    count += static_cast<std::size_t>(__builtin_popcount(marks_[w]));
  return count;
}

} // namespace slugs
