// Edit distance, see read/messages/spelling.hpp.

#include "read/messages/spelling.hpp"

#include <algorithm>

namespace slugs {

namespace {

constexpr std::size_t shortest_prefix = 4;
constexpr std::size_t longest_word = 80; // longer words get no suggestion

std::string lower(std::string_view word) {
  std::string result(word);
  for (char &c : result)
    if (c >= 'A' && c <= 'Z')
      c = static_cast<char>(c - 'A' + 'a');
  return result;
}

std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last(b.size() + 1), last(b.size() + 1), current(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j)
    last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      current[j] = std::min({last[j] + 1, current[j - 1] + 1, substituted});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        current[j] = std::min(current[j], before_last[j - 2] + 1);
    }
    std::swap(before_last, last);
    std::swap(last, current);
  }
  return last[b.size()];
}

} // namespace

std::string nearest_word(std::string_view word, const std::vector<std::string> &known) {
  if (word.size() > longest_word)
    return "";
  const std::string wanted = lower(word);
  // The only word with this prefix.
  if (word.size() >= shortest_prefix) {
    const auto begins = [&](const std::string &candidate) {
      return lower(candidate.substr(0, word.size())) == wanted;
    };
    const auto first = std::find_if(known.begin(), known.end(), begins);
    if (first != known.end() && std::find_if(first + 1, known.end(), begins) == known.end())
      return *first;
  }
  std::size_t best = std::max<std::size_t>(1, word.size() / 3) + 1;
  std::string nearest;
  for (const std::string &candidate : known) {
    if (candidate.size() > word.size() + best || word.size() > candidate.size() + best)
      continue;
    const std::size_t d = distance(wanted, lower(candidate));
    if (d < best && d < std::max(word.size(), candidate.size())) {
      best = d;
      nearest = candidate;
    }
  }
  return nearest;
}

} // namespace slugs
