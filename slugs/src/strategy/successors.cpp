// Lists are built bottom up for any variable order: the list of a node merges those of
// its children, with the node's variable set to 0 and 1.  If both children of an output
// variable have an entry for the same inputs, the lesser entry is kept.  So a list has
// at most one entry per input valuation, however many outputs the diagram allows.
// The diagrams of different states share lower nodes, so lists are cached by node.

#include "strategy/successors.hpp"

#include <algorithm>
#include <cassert>
#include <type_traits>

namespace slugs {

Successors::Successors(Game &game, Answers answers)
    : game_(game), words_(words_for(game.store.bits())), place_(2 * std::size_t{game.store.bits()}),
      mask_bits_before_{0}, mask_(words_), lists_(game.store.account()), list_of_(game.store.account()),
      found_(words_) {
  const std::vector<Variable> &variables = game.specification.variables;
  bool outputs_met = false;
  for (std::uint32_t bit = 0; bit < variables.size(); ++bit) {
    by_level_.push_back(next_var(bit));
    if (answers == Answers::All || variables[bit].owner == Owner::Input) {
      set_bit(mask_.data(), bit);
      sorted_ = sorted_ && !outputs_met;
    } else {
      outputs_met = true;
    }
  }
  std::sort(by_level_.begin(), by_level_.end(),
            [&](Var a, Var b) { return game.store.level_of(a) < game.store.level_of(b); });
  for (std::size_t k = 0; k < by_level_.size(); ++k) {
    place_[by_level_[k]] = k;
    mask_bits_before_.push_back(mask_bits_before_[k] + (get_bit(mask_.data(), by_level_[k] / 2) ? 1 : 0));
  }
  assert(by_level_.size() == game.store.bits() && mask_bits_before_.size() == by_level_.size() + 1);
  lists_.resize(words_ << 10);
}

bool Successors::ascends(const PackedStates &states) const {
  for (std::size_t i = 1; i < states.size(); ++i)
    if (!std::lexicographical_compare(states[i - 1], states[i - 1] + words_, states[i], states[i] + words_))
      return false;
  return true;
}

void Successors::forget() {
  list_of_.clear();
  used_ = 1;
}

const PackedStates &Successors::of(Edge f) {
  if (used_ > game_.store.tuning().valuations)
    forget();
  const List list = list_below(f, 0);
  assert(list.start + list.count <= used_);
  found_.assign(&lists_[list.start * words_], list.count);
  if (!sorted_)
    found_.sort();
  assert(ascends(found_));
  return found_;
}

// Return the valuations of by_level_[k..] that f allows; f depends on no other variable.
Successors::List Successors::list_below(Edge f, std::size_t k) {
  if (f == bdd_false)
    return {0, 0};
  assert(f == bdd_true || game_.store.edges().var_of(f) % 2 == 1); // the current state has been fixed
  std::size_t at = f == bdd_true ? by_level_.size() : place_[game_.store.edges().var_of(f)];
  assert(at >= k && at <= by_level_.size()); // levels ascend
  List list = f == bdd_true ? List{0, 1} : list_at(f, at);
  // A skipped variable takes both values; a skipped output takes its least value, 0.
  while (mask_bits_before_[at] != mask_bits_before_[k]) {
    const std::uint32_t bit = by_level_[--at] / 2;
    if (get_bit(mask_.data(), bit))
      list = join(list, list, bit);
  }
  return list;
}

Successors::List Successors::list_at(Edge f, std::size_t k) {
  assert(f > 1 && k < by_level_.size());
  if (const List *known = list_of_.find(f))
    return *known;
  const List low = list_below(game_.store.edges().low_of(f), k + 1);
  const List high = list_below(game_.store.edges().high_of(f), k + 1);
  const List list = join(low, high, by_level_[k] / 2);
  assert(list.count > 0 && list.count <= low.count + high.count);
  list_of_.add(f, list);
  return list;
}

// Merge both lists, with the bit set in the entries of `high`.
Successors::List Successors::join(List low, List high, std::uint32_t bit) {
  if (high.count == 0)
    return low;
  assert(bit < game_.store.bits() && low.start + low.count <= used_ && high.start + high.count <= used_);
  const std::size_t start = reserve(low.count + high.count);
  const Word *from = lists_.data();
  Word *to = lists_.data() + start * words_;
  const auto merged = [&](auto width) {
    constexpr std::size_t words = decltype(width)::value;
    return merge<words>(from + low.start * words_, low.count, from + high.start * words_, high.count, bit,
                        to);
  };
  const std::size_t count = words_ == 1   ? merged(std::integral_constant<std::size_t, 1>())
                            : words_ == 2 ? merged(std::integral_constant<std::size_t, 2>())
                                          : merged(std::integral_constant<std::size_t, 0>());
  assert(count >= std::max(low.count, high.count)); // at most one of two equals is dropped
  used_ = start + count;
  return {start, count};
}

// Small widths are compile-time constants; 0 denotes any width.
template <std::size_t Words>
std::size_t Successors::merge(const Word *low, std::size_t lows, const Word *high, std::size_t highs,
                              std::uint32_t bit, Word *result) const {
  const std::size_t words = Words ? Words : words_;
  const std::size_t place = bit / 64;
  const Word one = word_bit(bit);
  const Word *const low_end = low + lows * words, *const high_end = high + highs * words;
  Word *to = result;
  while (low != low_end || high != high_end) {
    // Compare the masked bits, then the other bits.
    int order = low == low_end ? 1 : high == high_end ? -1 : 0;
    bool same = order == 0;
    if (same) {
      int rest = 0;
      for (std::size_t w = 0; w < words && !order; ++w) {
        const Word a = low[w], b = high[w] | (w == place ? one : 0);
        const Word x = a & mask_[w], y = b & mask_[w];
        order = x < y ? -1 : x > y ? 1 : 0;
        if (!rest)
          rest = a < b ? -1 : a > b ? 1 : 0;
      }
      same = order == 0;
      if (same)
        order = rest;
    }
    assert(order < 0 ? low != low_end : high != high_end);
    const Word *const from = order < 0 ? low : high;
    for (std::size_t w = 0; w < words; ++w)
      to[w] = from[w];
    if (order >= 0)
      to[place] |= one;
    to += words;
    if (order < 0 || same)
      low += words;
    if (order >= 0 || same)
      high += words;
  }
  assert(low == low_end && high == high_end);
  return static_cast<std::size_t>(to - result) / words;
}

// Make room at the end of the lists, within the limits: a state may have more successors
// than fit into memory.
std::size_t Successors::reserve(std::size_t count) {
  const std::size_t needed = (used_ + count) * words_;
  if (needed > lists_.size()) {
    const MemoryAccount &account = game_.store.account();
    account.budget().check();
    const bool generous = account.has_room(lists_.size() * sizeof(Word));
    lists_.resize(generous ? std::max(needed, 2 * lists_.size()) : needed);
  }
  assert(needed <= lists_.size());
  return used_;
}

} // namespace slugs
