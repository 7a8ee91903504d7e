// Reordering in place by sifting (Rudell 1993), a pair of variables at a time:
// how; when is decided in reordering.hpp.

#pragma once

#include "bdd/bdd.hpp"

#include <cstdint>
#include <vector>

namespace slugs {

// What sifting did, so that it can be undone: each pair that moved, and from
// which position, in the order of the moves.
struct SiftedPair {
  std::uint32_t bit;
  std::uint32_t from;
};
using SiftingLog = std::vector<SiftedPair>;

inline constexpr std::uint64_t unlimited_sifting = static_cast<std::uint64_t>(-1);

// After a LimitReached out of any of these nothing but destruction is safe.
// Where memory is short they do nothing.

// Moves each pair to its best position, largest first.  Stops moving a pair when
// the diagrams exceed `growth` times their best size.  Appends to the log.  Moves
// no more pairs after it has visited `budget` nodes without effect; each time
// that the diagrams have been halved the count restarts.
void sift(BddStore &store, SiftingLog &log, double growth = 1.2, std::uint64_t budget = unlimited_sifting);
// The same for all nodes, also those that no handle can reach.  They are gone afterwards.
void sift_all(BddStore &store, SiftingLog &log, double growth, std::uint64_t budget);
// The reverse moves: every order on the way has been there before.
void undo_sifting(BddStore &store, const SiftingLog &log);

} // namespace slugs
