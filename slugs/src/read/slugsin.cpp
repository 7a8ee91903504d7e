// The stack machine of the parser, and printing formulas in prefix notation.

#include "read/slugsin.hpp"

#include "read/lexer.hpp"

#include <algorithm>
#include <cassert>
#include <limits>
#include <ostream>
#include <unordered_map>
#include <vector>

namespace slugs {

namespace {

constexpr const char *mixed_hint =
    "operators stand before their operands here, as in '| a & b c'; an infix line must be infix throughout";

} // namespace

FormulaId PrefixParser::parse(Lexer &line, Section section) {
  line_ = &line;
  section_ = section;
  waiting_.clear();
  buffers_.clear();
  done_ = failed_ = false;
  while (!done_ && !failed_) {
    const Lexeme lexeme = line_->take();
    switch (lexeme.token) {
    case Token::Not:
      negate(lexeme);
      break;
    case Token::And:
    case Token::Or:
    case Token::Xor:
      push_operator(lexeme);
      break;
    case Token::Dollar:
      open_buffer(lexeme);
      break;
    case Token::Question:
      recall(lexeme);
      break;
    case Token::Number:
      constant(lexeme);
      break;
    case Token::Name:
      name(lexeme);
      break;
    case Token::End:
      incomplete(lexeme);
      break;
    default:
      fail(lexeme, "found " + describe(lexeme) + ", expected a formula in prefix notation",
           lexeme.hint ? lexeme.hint : mixed_hint);
    }
  }
  assert(failed_ || (waiting_.empty() && buffers_.empty()));
  return failed_ ? pool_.constant(true) : result_;
}

void PrefixParser::fail(const Lexeme &lexeme, const std::string &message, const std::string &hint) {
  diagnostics_.error(lexeme.place, message, hint);
  failed_ = true;
}

// Consecutive negations wait as one operator.
void PrefixParser::negate(const Lexeme &lexeme) {
  if (waiting_.empty() || waiting_.back().op != Token::Not)
    waiting_.push_back({Token::Not, 0, 0});
  assert(waiting_.back().op == Token::Not);
  waiting_.back().column = lexeme.place.column;
  ++waiting_.back().held;
}

void PrefixParser::push_operator(const Lexeme &lexeme) {
  if (lexeme.hint)
    diagnostics_.error(lexeme.place, "found " + describe(lexeme), lexeme.hint);
  waiting_.push_back({lexeme.token, lexeme.place.column, none});
}

void PrefixParser::incomplete(const Lexeme &end) {
  if (waiting_.empty())
    return fail(end, "found the end of the line, expected a formula");
  const Waiting &open = waiting_.back();
  assert(open.op != Token::Dollar || !buffers_.empty());
  const std::string wanted =
      open.op == Token::Dollar ? "entry " + std::to_string(buffers_.back().entries.size()) +
                                     " of the buffer of " + std::to_string(buffers_.back().wanted) + " opened"
                               : "an operand of '" + std::string(line_->at(open.column).text) + "'";
  fail(end, "found the end of the line, expected " + wanted + " at column " + std::to_string(open.column));
}

// Read the decimal number after '$' or '?'.
bool PrefixParser::count(const Lexeme &after, std::uint64_t &number) {
  const Lexeme lexeme = line_->peek();
  if (lexeme.token != Token::Number) {
    fail(lexeme, "found " + describe(lexeme) + ", expected a number after '" + std::string(after.text) + "'",
         "'$ n f1 ... fn' is a buffer of n formulas, '? i' recalls entry i of it");
    return false;
  }
  line_->take();
  assert(!lexeme.text.empty());
  number = 0;
  for (const char digit : lexeme.text) {
    if (number > std::numeric_limits<std::uint32_t>::max()) {
      fail(lexeme, "number " + printable(lexeme.text, 20) + " is out of range");
      return false;
    }
    number = 10 * number + static_cast<std::uint64_t>(digit - '0');
  }
  return true;
}

void PrefixParser::open_buffer(const Lexeme &lexeme) {
  const Lexeme number = line_->peek();
  std::uint64_t wanted;
  if (!count(lexeme, wanted))
    return;
  if (wanted == 0)
    return fail(number, "a buffer needs at least one formula: its value is the last one");
  assert(!failed_ && wanted > 0);
  buffers_.push_back({{}, wanted});
  waiting_.push_back({Token::Dollar, lexeme.place.column, none});
}

void PrefixParser::recall(const Lexeme &lexeme) {
  const Lexeme number = line_->peek();
  std::uint64_t index;
  if (!count(lexeme, index))
    return;
  if (buffers_.empty())
    return fail(lexeme, "'?' outside a buffer", "a buffer is opened with '$ n'");
  const std::vector<FormulaId> &entries = buffers_.back().entries;
  if (index >= entries.size())
    return fail(number,
                "entry " + std::to_string(index) + " is not known yet: the buffer has " +
                    std::to_string(entries.size()) + " so far",
                "entries count from 0, and each may use earlier ones of the same buffer");
  assert(entries[index] < pool_.size());
  operand(entries[index]);
}

void PrefixParser::constant(const Lexeme &lexeme) {
  if (lexeme.text != "0" && lexeme.text != "1")
    return fail(lexeme, "found " + describe(lexeme) + ", expected a formula",
                "the constants are 0 and 1; comparisons of integers are infix, as in x = 3");
  operand(pool_.constant(lexeme.text == "1"));
}

void PrefixParser::name(const Lexeme &lexeme) {
  const Symbol *symbol = scope_.find(lexeme.text);
  const ForeignWord *word = symbol ? nullptr : foreign_word(lexeme.text, ForeignWord::Operator);
  if (word && line_->peek().token != Token::End)
    return fail(lexeme, word->message(), word->hint);
  bool next = false;
  if (line_->peek().token == Token::Prime) {
    next = true;
    line_->take();
  }
  if (line_->peek().token == Token::Prime)
    return fail(line_->peek(), "found a second prime", "only the current and the next value can be used");
  operand(value(symbol, lexeme, next));
}

FormulaId PrefixParser::value(const Symbol *symbol, const Lexeme &lexeme, bool next) {
  if (!symbol) {
    const bool infix = lexeme.text.find_first_of("()<>=+|&^!~\\") != std::string_view::npos;
    const bool constant = lexeme.text == "TRUE" || lexeme.text == "FALSE";
    scope_.report_undeclared(lexeme.text, lexeme.place,
                             constant ? "in prefix notation the constants are 1 and 0"
                             : infix  ? mixed_hint
                                      : "",
                             diagnostics_);
  } else if (symbol->integer) {
    diagnostics_.error(lexeme.place, "found integer '" + printable(lexeme.text) + "' in a prefix line",
                       "prefix lines use its bits only; write the line infix to compare integers");
  } else if (scope_.check_use(*symbol, lexeme.text, lexeme.place, section_, next, diagnostics_)) {
    return pool_.variable(symbol->index, next);
  }
  return pool_.constant(true);
}

// Hand a finished formula to the operator that waits for it, which may thereby be
// finished too.
void PrefixParser::operand(FormulaId formula) {
  while (!waiting_.empty()) {
    Waiting &top = waiting_.back();
    assert(formula < pool_.size());
    assert(top.op != Token::Not || top.held > 0);
    if (top.op == Token::Not) {
      formula = top.held % 2 == 1 ? pool_.negation(formula) : formula;
    } else if (top.op == Token::Dollar) {
      assert(!buffers_.empty() && buffers_.back().entries.size() < buffers_.back().wanted);
      buffers_.back().entries.push_back(formula);
      if (buffers_.back().entries.size() < buffers_.back().wanted)
        return;
      buffers_.pop_back(); // its value is its last entry
    } else if (top.held == none) {
      top.held = formula;
      return;
    } else {
      assert(top.op == Token::And || top.op == Token::Or || top.op == Token::Xor);
      formula = top.op == Token::And  ? pool_.conjunction(top.held, formula)
                : top.op == Token::Or ? pool_.disjunction(top.held, formula)
                                      : pool_.exclusive_or(top.held, formula);
    }
    waiting_.pop_back();
  }
  assert(!done_ && buffers_.empty());
  result_ = formula;
  done_ = true;
  if (line_->peek().token != Token::End)
    fail(line_->peek(),
         "found " + describe(line_->peek()) + ", expected the end of the line: the formula is complete",
         line_->peek().hint ? line_->peek().hint : mixed_hint);
}

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
      assert(open.back() <= root); // operands have smaller ids
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
        assert(entry->second < entries_.size());
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
        assert(node.left < specification_.variables.size());
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

// Print variables in declaration order, which fixes the order of states, with a
// new heading each time that the owner changes.  An empty file is invalid, so there is at least one.
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
