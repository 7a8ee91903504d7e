// Printing formulas in prefix notation, see read/slugsin/translate.hpp.

#include "read/slugsin/translate.hpp"

#include <algorithm>
#include <ostream>
#include <unordered_map>
#include <vector>

namespace slugs {

namespace {

class FormulaPrinter {
public:
  FormulaPrinter(const Specification &specification, std::ostream &out)
      : specification_(specification), pool_(specification.formulas), out_(out) {}

  // Print a line without its end.
  void print(FormulaId root) {
    entries_.clear();
    const std::vector<FormulaId> shared = find_shared(root);
    if (shared.empty())
      return print_tree(root);
    out_ << "$ " << shared.size() + 1;
    for (const FormulaId formula : shared) {
      out_ << ' ';
      print_tree(formula);
      entries_.emplace(formula, entries_.size());
    }
    out_ << ' ';
    print_tree(root);
  }

private:
  bool is_leaf(FormulaId id) const {
    const Op op = pool_[id].op;
    return op == Op::False || op == Op::True || op == Op::Variable ||
           (op == Op::Not && pool_[pool_[id].left].op == Op::Variable);
  }

  // Return the formulas below the root that several others use, operands first.
  std::vector<FormulaId> find_shared(FormulaId root) const {
    std::unordered_map<FormulaId, int> uses;
    std::vector<FormulaId> open = {root};
    const auto use = [&](FormulaId id) {
      if (!is_leaf(id) && ++uses[id] == 1)
        open.push_back(id);
    };
    while (!open.empty()) {
      const FormulaNode node = pool_[open.back()];
      open.pop_back();
      if (node.op >= Op::Not)
        use(node.left);
      if (node.op > Op::Not)
        use(node.right);
    }
    std::vector<FormulaId> shared;
    for (const auto &[id, count] : uses)
      if (count > 1)
        shared.push_back(id);
    std::sort(shared.begin(), shared.end()); // operands have smaller ids
    return shared;
  }

  // Print `root` in full, and formulas below it that are already entries as "?
  // i".
  void print_tree(FormulaId root) {
    std::vector<FormulaId> open = {root};
    bool first = true;
    while (!open.empty()) {
      const FormulaId id = open.back();
      open.pop_back();
      if (!first)
        out_ << ' ';
      first = false;
      if (const auto entry = entries_.find(id); entry != entries_.end()) {
        out_ << "? " << entry->second;
        continue;
      }
      const FormulaNode node = pool_[id];
      switch (node.op) {
      case Op::False:
        out_ << '0';
        break;
      case Op::True:
        out_ << '1';
        break;
      case Op::Variable:
        out_ << specification_.variables[node.left].name << (node.right ? "'" : "");
        break;
      case Op::Not:
        out_ << '!';
        break;
      case Op::And:
        out_ << '&';
        break;
      case Op::Or:
        out_ << '|';
        break;
      case Op::Xor:
        out_ << '^';
        break;
      }
      if (node.op > Op::Not)
        open.push_back(node.right);
      if (node.op >= Op::Not)
        open.push_back(node.left);
    }
  }

  const Specification &specification_;
  const FormulaPool &pool_;
  std::ostream &out_;
  std::unordered_map<FormulaId, std::size_t> entries_;
};

// In declaration order, which fixes the order of states: a new heading each
// time that the owner changes.  One that is all, too: nobody reads an empty file.
void print_variables(const Specification &specification, std::ostream &out) {
  if (specification.variables.empty())
    out << "[OUTPUT]\n";
  const Owner *last = nullptr;
  for (const Variable &variable : specification.variables) {
    if (!last || *last != variable.owner)
      out << (last ? "\n" : "") << (variable.owner == Owner::Input ? "[INPUT]\n" : "[OUTPUT]\n");
    last = &variable.owner;
    out << variable.name << '\n';
  }
}

} // namespace

void translate(const Specification &specification, std::ostream &out) {
  print_variables(specification, out);
  FormulaPrinter printer(specification, out);
  for (std::size_t i = 0; i < section_count; ++i) {
    if (specification.constraints[i].empty())
      continue;
    out << "\n[" << section_names[i] << "]\n";
    for (const Constraint &constraint : specification.constraints[i]) {
      if (constraint.range_limit)
        out << "# limits of " << specification.text(constraint) << '\n';
      printer.print(constraint.formula);
      out << '\n';
    }
  }
}

} // namespace slugs
