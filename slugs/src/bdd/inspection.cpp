// Evaluation, satisfying valuations, support and size of functions.

#include "bdd/bdd.hpp"

#include <cmath>
#include <unordered_map>

namespace slugs {

bool BddStore::evaluate(Edge f, const std::vector<bool> &value_of_var) const {
  while (f > 1)
    f = value_of_var[operations_.var_of(f)] ? operations_.high_of(f) : operations_.low_of(f);
  return f == bdd_true;
}

std::vector<bool> BddStore::some_valuation(const Bdd &f) const {
  assert(!f.is_false());
  std::vector<bool> result(2 * std::size_t{bits()}, false);
  for (Edge e = f.edge(); e > 1;) {
    const bool value = operations_.low_of(e) == bdd_false;
    result[operations_.var_of(e)] = value;
    e = value ? operations_.high_of(e) : operations_.low_of(e);
  }
  return result;
}

double BddStore::count(const Bdd &f, const std::vector<Var> &over) const {
  // Compute the fraction of satisfying valuations and scale it, which needs no levels.
  // An edge and its complement are visited separately, since 1 - x loses precision.
  std::unordered_map<Edge, double> fraction{{bdd_false, 0.0}, {bdd_true, 1.0}};
  const auto visit = [&](const auto &self, Edge e) -> double {
    const auto known = fraction.find(e);
    if (known != fraction.end())
      return known->second;
    const double low = self(self, operations_.low_of(e));
    const double high = self(self, operations_.high_of(e));
    return fraction[e] = (low + high) / 2;
  };
  return std::ldexp(visit(visit, f.edge()), static_cast<int>(over.size()));
}

std::vector<Var> BddStore::support(const Bdd &f) {
  UniqueTable &table = operations_.table();
  table.clear_marks();
  std::vector<std::uint8_t> seen(table.levels(), 0);
  const auto visit = [&](const auto &self, Edge e) -> void {
    const std::uint32_t n = e >> 1;
    if (!n || table.marked(n))
      return;
    table.set_mark(n);
    seen[table.var_of(e)] = 1;
    self(self, table.low_of(e));
    self(self, table.high_of(e));
  };
  visit(visit, f.edge());
  std::vector<Var> result;
  for (Var v = 0; v < seen.size(); ++v)
    if (seen[v])
      result.push_back(v);
  return result;
}

std::size_t BddStore::size(const Bdd &f) {
  UniqueTable &table = operations_.table();
  table.clear_marks();
  table.mark(f.edge());
  return table.count_marks();
}

} // namespace slugs
