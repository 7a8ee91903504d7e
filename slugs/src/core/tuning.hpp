// The constants of the engine: each affects speed and memory, none a verdict or a strategy.
//
// README.md has the measurements behind the values.  Tests draw others from the ranges.

#pragma once

#include <cstddef>

namespace slugs {

// Name, value, least, most, meaning.
// clang-format off
#define SLUGS_TUNING(constant)                                                                              \
  constant(sift_first, 1u << 14, 1u << 4, 1u << 24, "nodes at which diagrams are sifted first")             \
  constant(sift_later, 2, 2, 64, "growth before the next sifting, after one that gained much")              \
  constant(sift_vain, 16, 2, 64, "the same after one that gained little")                                   \
  constant(sift_fixpoints, 8, 2, 64, "growth before sifting in a fixpoint")                                 \
  constant(sift_step, 4, 2, 64, "the same after a step has gained much")                                    \
  constant(sift_passes, 6, 1, 100, "passes of a thorough sifting")                                          \
  constant(sift_pairs, 1000, 1, 1u << 20, "pairs beyond which a pass has a budget")                         \
  constant(sift_share, 8, 1, 1u << 10, "divides the work that sifting with uncertain gain may take")        \
  constant(sift_least, 1u << 22, 1u << 8, 1u << 22, "nodes that such sifting may visit, at least")          \
  constant(sift_most, 1u << 24, 1u << 22, 1u << 30, "nodes that such sifting may visit, at most")           \
  constant(growth, 120, 100, 1000, "per cent of its best size to which a diagram may grow in sifting")      \
  constant(growth_early, 110, 100, 1000, "the same while the game is built")                                \
  constant(growth_late, 105, 100, 1000, "the same in a fixpoint")                                           \
  constant(operation_nodes, 1u << 18, 1u << 10, 1u << 28, "nodes that an operation may create")             \
  constant(operation_work, 1u << 21, 1u << 10, 1u << 30, "steps that an operation may take")                \
  constant(operation_later, 2, 2, 64, "factor of both after sifting that gained much")                      \
  constant(operation_vain, 8, 2, 64, "factor of both after sifting that gained little")                     \
  constant(collect_early, 1u << 16, 1, 1u << 24, "nodes before each of the first collections")              \
  constant(collect_late, 1u << 18, 1, 1u << 24, "nodes before later collections")                           \
  constant(collections_early, 8, 0, 1u << 10, "number of first collections")                                \
  constant(collect_growth, 3, 1, 64, "growth before the next collection")                                   \
  constant(table_first, 1u << 12, 1u << 6, 1u << 20, "first size of the node table; a power of two")        \
  constant(table_doubled, 1u << 20, 1, 1u << 28, "nodes up to which the table doubles")                     \
  constant(cache_first, 1u << 12, 1u << 6, 1u << 20, "first size of the operation cache; a power of two")   \
  constant(cache_near, 1u << 18, 1, 1u << 24, "entries up to which there is one for each node")             \
  constant(cache_largest, 1u << 21, 1, 1u << 26, "entries beyond which the cache does not grow")            \
  constant(factor_nodes, 10000, 1, 1u << 28, "nodes beyond which a relation gets another factor")           \
  constant(factor_looks, 32, 1, 1u << 10, "conjunctions between measurements of a factor")                  \
  constant(bottom_up, 1000, 1, 1u << 28, "number of conjuncts beyond which they are conjoined bottom up")   \
  constant(scan_share, 4, 1, 1u << 10, "range of ids, per operator, beyond which operators are sorted")     \
  constant(reached_share, 8, 1, 1u << 10, "divides the work that checks of reached goals may take")         \
  constant(pool_slots, 1u << 20, 1u << 6, 1u << 26, "size of the table of all formulas; a power of two")       \
  constant(pool_recent, 1u << 16, 1u << 6, 1u << 26, "its size where it holds recent ones; a power of two")  \
  constant(part_inputs, 2, 1, 64, "inputs that a part of the environment needs")                            \
  constant(hub_factor, 8, 1, 1u << 10, "occurrences of a hub, per occurrence of the median variable")       \
  constant(force_rounds, 60, 0, 1u << 10, "rounds of FORCE")                                                \
  constant(force_stale, 5, 1, 1u << 10, "rounds of FORCE without gain")                                     \
  constant(force_pins, 1u << 26, 0, 1u << 30, "occurrences that FORCE visits")                              \
  constant(garbage, 1u << 18, 1, 1u << 28, "new nodes before a collection in the extraction")               \
  constant(listed, 1u << 22, 1, 1u << 28, "numbers of nodes in cached lists of successors")                 \
  constant(valuations, 1u << 16, 1, 1u << 26, "valuations in cached lists of diagrams")                     \
  constant(cofactors, 1u << 20, 1u << 4, 1u << 26, "cached cofactors by states; a power of two")            \
  constant(level_stack, 512, 512, 1u << 14, "bytes of stack for each level of a diagram")
// clang-format on

struct Tuning {
#define SLUGS_MEMBER(name, value, least, most, what)                                                         \
  static_assert((least) <= (value) && (value) <= (most), what);                                              \
  std::size_t name = value;
  SLUGS_TUNING(SLUGS_MEMBER)
#undef SLUGS_MEMBER

  // Call visit(constant, least, most) for each constant.
  template <class Visit> void each(Visit visit) {
#define SLUGS_VISIT(name, value, least, most, what) visit(name, std::size_t{least}, std::size_t{most});
    SLUGS_TUNING(SLUGS_VISIT)
#undef SLUGS_VISIT
  }
  bool in_range() const {
    bool result = true;
    Tuning copy = *this;
    copy.each([&](std::size_t value, std::size_t least, std::size_t most) {
      result = result && least <= value && value <= most;
    });
    return result;
  }
};

} // namespace slugs
