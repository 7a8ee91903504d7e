#include "game/independent_parts.hpp"

#include "game/conjuncts.hpp"

#include <map>
#include <numeric>
#include <utility>

namespace slugs {

namespace {

// Sets of variables that are joined (Galler and Fischer 1964).
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

struct Reads {
  std::vector<std::uint32_t> present;
  std::vector<std::uint32_t> next_inputs;
  bool next_outputs = false;
};

} // namespace

Environment independent_parts(const Specification &specification, FormulaPool &formulas,
                              const Budget &budget) {
  // A part with fewer inputs of its own is not worth an operation.
  constexpr std::size_t least_own = 2;
  BudgetPacer pacer(budget);
  const auto reads_of = [&](FormulaId f) {
    pacer.step();
    Reads reads;
    mentions(formulas, f, [&](const FormulaNode &variable) {
      if (!variable.right)
        reads.present.push_back(variable.left);
      else if (specification.variables[variable.left].owner == Owner::Input)
        reads.next_inputs.push_back(variable.left);
      else
        reads.next_outputs = true;
      return false;
    });
    return reads;
  };
  Environment environment;
  environment.shared = conjuncts(specification, formulas, Section::EnvTrans);
  const std::size_t n = specification.variables.size();
  Groups groups(n);
  std::vector<Reads> reads;
  for (const FormulaId f : environment.shared) {
    reads.push_back(reads_of(f));
    for (const std::uint32_t v : reads.back().next_inputs)
      groups.join(v, reads.back().next_inputs.front());
  }

  // Whose present values are asked for by anything but their own group.
  std::vector<bool> asked_for(n, false);
  for (const Reads &constraint : reads)
    for (const std::uint32_t v : constraint.present)
      if (constraint.next_inputs.empty() || groups.of(v) != groups.of(constraint.next_inputs.front()))
        asked_for[v] = true;
  for (const Section section : {Section::SysTrans, Section::EnvLiveness, Section::SysLiveness})
    for (const FormulaId f : conjuncts(specification, formulas, section)) {
      const Reads constraint = reads_of(f);
      if (section != Section::SysTrans || constraint.next_outputs)
        for (const std::uint32_t v : constraint.present)
          asked_for[v] = true;
    }

  std::map<std::uint32_t, IndependentPart> parts; // by group
  for (std::uint32_t v = 0; v < n; ++v)
    if (specification.variables[v].owner == Owner::Input && !asked_for[v])
      parts[groups.of(v)].own.push_back(v);
  for (auto part = parts.begin(); part != parts.end();)
    part = part->second.own.size() < least_own ? parts.erase(part) : std::next(part);
  if (parts.size() < 2)
    return environment;
  const std::vector<FormulaId> all = std::exchange(environment.shared, {});
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto part =
        reads[i].next_inputs.empty() ? parts.end() : parts.find(groups.of(reads[i].next_inputs.front()));
    (part == parts.end() ? environment.shared : part->second.constraints).push_back(all[i]);
  }
  for (auto &[group, part] : parts)
    environment.parts.push_back(std::move(part));
  return environment;
}

} // namespace slugs
