// Edges and variables.
//
// An edge is twice a node index, plus one if complemented.  Node 0 is the
// constant false, so the edges 0 and 1 are false and true.  Variables come in
// pairs: 2i is the current and 2i + 1 the next value of bit i.

#pragma once

#include <cstdint>

namespace slugs {

using Edge = std::uint32_t;
using Var = std::uint32_t;
using VarSet = std::uint32_t; // index returned by BddStore::make_set

inline constexpr Edge bdd_false = 0;
inline constexpr Edge bdd_true = 1;

constexpr Var current_var(std::uint32_t bit) { return 2 * bit; }
constexpr Var next_var(std::uint32_t bit) { return 2 * bit + 1; }

} // namespace slugs
