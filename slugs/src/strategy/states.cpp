// Sorting of valuations, a direct-mapped cache of cofactors by states, and ranks.

#include "strategy/states.hpp"

#include "core/hash.hpp"

#include <algorithm>
#include <cassert>
#include <map>
#include <numeric>

namespace slugs {

void PackedStates::sort() {
  if (words_ == 1) {
    std::sort(data_.begin(), data_.end());
    return;
  }
  std::vector<std::size_t> index(size());
  std::iota(index.begin(), index.end(), std::size_t{0});
  std::sort(index.begin(), index.end(), [&](std::size_t a, std::size_t b) {
    return std::lexicographical_compare((*this)[a], (*this)[a] + words_, (*this)[b], (*this)[b] + words_);
  });
  std::vector<Word> sorted;
  sorted.reserve(data_.size());
  for (const std::size_t i : index)
    sorted.insert(sorted.end(), (*this)[i], (*this)[i] + words_);
  assert(sorted.size() == data_.size());
  data_.swap(sorted);
}

// Direct-mapped cache of cofactors by states.

StateCofactor::StateCofactor(BddStore &store, const std::vector<Bdd> &functions)
    : edges_(store.edges()), words_(words_for(store.bits())), slots_(store.account()),
      keys_(store.account()) {
  std::uint32_t largest = 0;
  std::vector<Edge> todo;
  std::vector<std::uint32_t> nodes;
  std::vector<bool> seen;
  const auto meet = [&](Edge e) {
    const std::uint32_t n = e >> 1;
    if (n >= seen.size())
      seen.resize(std::max<std::size_t>(n + 1, 2 * seen.size()));
    if (n && !seen[n]) {
      seen[n] = true;
      todo.push_back(e & ~1u);
      largest = std::max(largest, n);
    }
  };
  for (const Bdd &f : functions)
    meet(f.edge());
  while (!todo.empty()) {
    const Edge e = todo.back();
    todo.pop_back();
    nodes.push_back(e);
    meet(edges_.low_of(e));
    meet(edges_.high_of(e));
  }
  // Bottom up by level; equal masks are stored once.
  std::sort(nodes.begin(), nodes.end(), [&](Edge a, Edge b) {
    return store.level_of(edges_.var_of(a)) > store.level_of(edges_.var_of(b));
  });
  mask_of_.assign(std::size_t{largest} + 1, next_only);
  std::map<std::vector<Word>, std::uint32_t> known;
  std::vector<Word> mask(words_);
  for (const Edge e : nodes) {
    std::fill(mask.begin(), mask.end(), 0);
    for (const Edge child : {edges_.low_of(e), edges_.high_of(e)})
      if (child > 1 && mask_of_[child >> 1] != next_only)
        for (std::size_t w = 0; w < words_; ++w)
          mask[w] |= masks_[mask_of_[child >> 1] * words_ + w];
    const Var v = edges_.var_of(e);
    assert(v / 2 < store.bits());
    if (v % 2 == 0)
      set_bit(mask.data(), v / 2);
    if (std::all_of(mask.begin(), mask.end(), [](Word w) { return w == 0; }))
      continue;
    const auto [place, fresh] = known.try_emplace(mask, static_cast<std::uint32_t>(known.size()));
    if (fresh)
      masks_.insert(masks_.end(), mask.begin(), mask.end());
    mask_of_[e >> 1] = place->second;
    assert(masks_.size() == known.size() * words_);
  }
  std::size_t size = 1 << 10;
  while (size < 4 * nodes.size() && size < store.tuning().cofactors)
    size *= 2;
  assert((size & (size - 1)) == 0);
  slots_.resize(size);
  keys_.resize(size * words_);
}

void StateCofactor::forget() { slots_.clear_to_zero(); }

Edge StateCofactor::operator()(Edge f, const Word *state) {
  const Edge result = visit(f, state);
  assert(result <= 1 || edges_.var_of(result) % 2 == 1); // a function of next variables
  return result;
}

Edge StateCofactor::visit(Edge f, const Word *state) {
  const Edge complement = f & 1;
  f ^= complement;

  assert(f >> 1 < mask_of_.size()); // f belongs to the functions of the constructor
  if (f <= 1 || mask_of_[f >> 1] == next_only)
    return f ^ complement;
  const Var v = edges_.var_of(f);
  if (v % 2 == 0)
    return visit(get_bit(state, v / 2) ? edges_.high_of(f) : edges_.low_of(f), state) ^ complement;

  const std::uint32_t n = f >> 1;
  assert((mask_of_[n] + 1) * words_ <= masks_.size());
  const Word *mask = &masks_[mask_of_[n] * words_];
  Word hash = n * golden_multiplier;
  for (std::size_t w = 0; w < words_; ++w)
    hash = mix(hash, state[w] & mask[w]);
  const std::size_t slot = hash & (slots_.size() - 1);
  Word *key = &keys_[slot * words_];
  if (slots_[slot].node == n) {
    bool same = true;
    for (std::size_t w = 0; w < words_; ++w)
      same = same && key[w] == (state[w] & mask[w]);
    if (same) {
      assert(edges_.is_alive(slots_[slot].result)); // else a collection did not forget it
      return slots_[slot].result ^ complement;
    }
  }
  const Edge low = visit(edges_.low_of(f), state);
  const Edge high = visit(edges_.high_of(f), state);
  const Edge result = edges_.node(v, low, high);
  slots_[slot] = {n, result};
  for (std::size_t w = 0; w < words_; ++w)
    key[w] = state[w] & mask[w];
  return result ^ complement;
}

// Advance the rank once per state if possible, else per successor.

Ranks::Ranks(BddStore &store, StateCofactor &cofactor, const std::vector<Bdd> &conditions)
    : edges_(store.edges()), cofactor_(cofactor), conditions_(conditions), cofactors_(conditions.size()) {}

Ranks::Step Ranks::from(const Word *state, std::uint32_t rank) {
  assert(rank < conditions_.size());
  std::uint32_t result = rank;
  do {
    const Edge condition = cofactor_(conditions_[result].edge(), state);
    if (condition == bdd_false)
      return {result, 0};
    if (condition != bdd_true) {
      for (std::size_t i = 0; i < conditions_.size(); ++i)
        cofactors_[i] = cofactor_(conditions_[i].edge(), state);
      const auto number = static_cast<std::uint32_t>(signatures_.size() + 1);
      assert(number != 0);
      return {rank, signatures_.try_emplace(cofactors_, number).first->second};
    }
    result = static_cast<std::uint32_t>((result + 1) % conditions_.size());
  } while (result != rank);
  return {result, 0};
}

std::uint32_t Ranks::advance(const Step &step, const Word *next) const {
  if (!step.signature)
    return step.rank;
  assert(step.rank < conditions_.size() && cofactors_.size() == conditions_.size());
  std::uint32_t result = step.rank;
  do {
    Edge e = cofactors_[result];
    assert(edges_.is_alive(e));
    while (e > 1)
      e = get_bit(next, edges_.var_of(e) / 2) ? edges_.high_of(e) : edges_.low_of(e);
    assert(edges_.is_terminal(e));
    if (e == bdd_false)
      break;
    result = static_cast<std::uint32_t>((result + 1) % conditions_.size());
  } while (result != step.rank);
  return result;
}

} // namespace slugs
