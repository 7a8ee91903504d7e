#include "game/product.hpp"

#include <algorithm>

namespace slugs {

Product::Product(BddStore &store, const std::vector<Bdd> &relations, const std::vector<Var> &quantified)
    : store_(store) {
  std::vector<Var> left = quantified;
  for (std::size_t i = relations.size(); i-- > 0;) {
    const std::vector<Var> support = store.support(relations[i]);
    const auto reads = [&](Var v) { return std::binary_search(support.begin(), support.end(), v); };
    const auto dropped = std::partition(left.begin(), left.end(), [&](Var v) { return !reads(v); });
    factors_.push_back({relations[i], store.make_set({dropped, left.end()})});
    left.erase(dropped, left.end());
  }
  std::reverse(factors_.begin(), factors_.end());
  unread_ = store.make_set(left);
}

Bdd Product::operator()(const Bdd &f) const {
  Bdd result = store_.exists(f, unread_);
  for (const Factor &factor : factors_)
    result = store_.and_exists(result, factor.relation, factor.dropped);
  return result;
}

} // namespace slugs
