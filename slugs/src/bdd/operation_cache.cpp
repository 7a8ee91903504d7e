// How large the cache is, see operation_cache.hpp.

#include "bdd/operation_cache.hpp"

#include <algorithm>

namespace slugs {

OperationCache::OperationCache(MemoryAccount &account) : account_(account), entries_(account) {
  entries_.resize(1 << 12);
}

void OperationCache::fit(std::size_t nodes) {
  // As many entries as nodes while both fit a processor's caches, then a quarter:
  // a larger table finds little more and costs a memory access for each look.
  constexpr std::size_t near = 1u << 18, largest = 1u << 21;
  const std::size_t wanted = std::min(std::max(std::min(nodes, near), nodes / 4), largest);
  const std::size_t old = entries_.size();
  std::size_t size = old;
  while (size < wanted)
    size *= 2;
  if (size == old || !account_.has_room((size - old) * sizeof(Entry)))
    return;
  entries_.resize(size);
  // Entries move up by a multiple of the old size, or stay.
  for (std::size_t i = 0; i < old; ++i) {
    const Entry entry = entries_[i];
    Entry &moved = entries_[place_of(entry.f_and_operation, entry.g, entry.h)];
    if (!entry.f_and_operation || &moved == &entries_[i])
      continue;
    moved = entry;
    entries_[i] = {};
  }
}

} // namespace slugs
