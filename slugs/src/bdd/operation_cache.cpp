// Size of the operation cache.

#include "bdd/operation_cache.hpp"

#include <algorithm>

namespace slugs {

OperationCache::OperationCache(MemoryAccount &account) : account_(account), entries_(account) {
  entries_.resize(1 << 12);
}

void OperationCache::fit(std::size_t nodes) {
  // One entry per node while both fit the processor's caches, then one per four
  // nodes: a larger cache has few more hits, and each lookup is a memory access.
  constexpr std::size_t near = 1u << 18, largest = 1u << 21;
  const std::size_t wanted = std::min(std::max(std::min(nodes, near), nodes / 4), largest);
  const std::size_t old = entries_.size();
  std::size_t size = old;
  while (size < wanted)
    size *= 2;
  if (size == old || !account_.has_room((size - old) * sizeof(Entry)))
    return;
  entries_.resize(size);
  // An entry stays, or moves up by a multiple of the old size.
  for (std::size_t i = 0; i < old; ++i) {
    const Entry entry = entries_[i];
    Entry &moved = entries_[slot_of(entry.f_and_operation, entry.g, entry.h)];
    if (!entry.f_and_operation || &moved == &entries_[i])
      continue;
    moved = entry;
    entries_[i] = {};
  }
}

} // namespace slugs
