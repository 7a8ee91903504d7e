// Sorting lists of packed valuations.

#include "strategy/states/packed_states.hpp"

#include <algorithm>
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
  data_.swap(sorted);
}

} // namespace slugs
