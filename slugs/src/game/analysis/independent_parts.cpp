#include "game/analysis/independent_parts.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

namespace slugs {

namespace {

// Union-find over variables (Galler and Fischer 1964).
class Groups {
public:
  explicit Groups(std::size_t n) : leader_(n) { std::iota(leader_.begin(), leader_.end(), 0u); }
  std::uint32_t of(std::uint32_t v) {
    while (leader_[v] != v)
      v = leader_[v] = leader_[leader_[v]];
    return v;
  }
  void join(std::uint32_t v, std::uint32_t w) { leader_[of(v)] = of(w); }

private:
  std::vector<std::uint32_t> leader_;
};

} // namespace

Environment independent_parts(const Specification &specification, const Conjuncts &conjuncts,
                              const Budget &budget) {
  // A part with fewer own inputs does not justify a separate relation.
  constexpr std::size_t least_own = 2;
  constexpr std::uint32_t none = static_cast<std::uint32_t>(-1);
  BudgetPacer pacer(budget);
  const auto is_input = [&](Read read) {
    return specification.variables[read.variable].owner == Owner::Input;
  };
  Environment environment;
  environment.shared = conjuncts[Section::EnvTrans];
  const std::size_t n = specification.variables.size();
  Groups groups(n);
  std::vector<std::uint32_t> first_next; // first next input of each constraint, or none
  for (const Conjunct &constraint : environment.shared) {
    std::uint32_t first = none;
    for (const Read read : conjuncts.reads(constraint)) {
      pacer.step();
      if (!read.next || !is_input(read))
        continue;
      if (first == none)
        first = read.variable;
      groups.join(read.variable, first);
    }
    first_next.push_back(first);
  }

  // Variables whose current values are read outside of their own group.
  std::vector<bool> read_elsewhere(n, false);
  for (std::size_t i = 0; i < environment.shared.size(); ++i)
    for (const Read read : conjuncts.reads(environment.shared[i])) {
      pacer.step();
      if (!read.next && (first_next[i] == none || groups.of(read.variable) != groups.of(first_next[i])))
        read_elsewhere[read.variable] = true;
    }
  for (const Section section : {Section::SysTrans, Section::EnvLiveness, Section::SysLiveness})
    for (const Conjunct &constraint : conjuncts[section]) {
      const Conjuncts::Reads reads = conjuncts.reads(constraint);
      const bool reads_state =
          section != Section::SysTrans ||
          std::any_of(reads.begin(), reads.end(), [&](Read read) { return read.next && !is_input(read); });
      for (const Read read : reads) {
        pacer.step();
        if (reads_state && !read.next)
          read_elsewhere[read.variable] = true;
      }
    }

  std::map<std::uint32_t, IndependentPart> parts; // keyed by group
  for (std::uint32_t v = 0; v < n; ++v)
    if (specification.variables[v].owner == Owner::Input && !read_elsewhere[v])
      parts[groups.of(v)].own.push_back(v);
  for (auto part = parts.begin(); part != parts.end();)
    part = part->second.own.size() < least_own ? parts.erase(part) : std::next(part);
  if (parts.size() < 2)
    return environment;
  const std::vector<Conjunct> all = std::exchange(environment.shared, {});
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto part = first_next[i] == none ? parts.end() : parts.find(groups.of(first_next[i]));
    (part == parts.end() ? environment.shared : part->second.constraints).push_back(all[i]);
  }
  for (auto &[group, part] : parts)
    environment.parts.push_back(std::move(part));
  return environment;
}

} // namespace slugs
