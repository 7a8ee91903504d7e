// "Did you mean": the known word nearest to one that is not known.
//
// Distance is that of Damerau (CACM 1964) in its restricted form: insertions,
// deletions, substitutions and swaps of neighbours each cost one.  A word
// counts as near if at most a third of it (at least one letter) is wrong, case
// aside, or if it begins one known word only.

#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace slugs {

// The nearest of `known`, the first of equals; empty if none is near.
std::string nearest_word(std::string_view word, const std::vector<std::string> &known);

} // namespace slugs
