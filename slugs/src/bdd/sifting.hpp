// In-place sifting (Rudell 1993) of variable pairs: the mechanism.  The policy is in
// reordering.hpp.

#pragma once

#include "bdd/bdd.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

// Log of sifting, for undoing it: each moved pair with its former position, in the
// order of the moves.
struct SiftedPair {
  std::uint32_t bit;
  std::uint32_t from;
};
using SiftingLog = std::vector<SiftedPair>;

inline constexpr std::uint64_t unlimited_sifting = static_cast<std::uint64_t>(-1);

// If one of these functions throws LimitReached, the store may only be destroyed.
// If memory for the reference counts is short, they have no effect.

// Move each pair to its best position, largest first, and append the moves to the log.
// Stop moving a pair when the diagrams exceed `growth` times their best size.  Stop
// entirely after `budget` visited nodes; the count restarts whenever the size has
// halved.
void sift(BddStore &store, SiftingLog &log, double growth = 1.2, std::uint64_t budget = unlimited_sifting);
// Sift as above, but minimize all nodes, including garbage; then collect the garbage.
void sift_all(BddStore &store, SiftingLog &log, double growth, std::uint64_t budget);
// Undo the logged moves in reverse; no order is visited that sifting did not visit.
void undo_sifting(BddStore &store, const SiftingLog &log);

} // namespace slugs
