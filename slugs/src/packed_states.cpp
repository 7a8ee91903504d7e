// Sorting lists of packed valuations.

#include "packed_states.hpp"

#include <algorithm>
#include <numeric>

namespace slugs {

void PackedStates::permute(const std::vector<std::size_t> &index) {
  std::vector<Word> sorted;
  sorted.reserve(index.size() * words_);
  for (const std::size_t i : index)
    sorted.insert(sorted.end(), (*this)[i], (*this)[i] + words_);
  data_.swap(sorted);
}

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
  permute(index);
}

void PackedStates::keep_least_for_each(const std::vector<Word> &mask) {
  sort();
  const auto compare = [&](std::size_t a, std::size_t b) { // by what the mask shows
    for (std::size_t w = 0; w < words_; ++w) {
      const Word x = (*this)[a][w] & mask[w], y = (*this)[b][w] & mask[w];
      if (x != y)
        return x < y ? -1 : 1;
    }
    return 0;
  };
  std::vector<std::size_t> index(size());
  std::iota(index.begin(), index.end(), std::size_t{0});
  std::stable_sort(index.begin(), index.end(),
                   [&](std::size_t a, std::size_t b) { return compare(a, b) < 0; });
  index.erase(std::unique(index.begin(), index.end(),
                          [&](std::size_t a, std::size_t b) { return compare(a, b) == 0; }),
              index.end());
  std::sort(index.begin(), index.end());
  permute(index);
}

} // namespace slugs
