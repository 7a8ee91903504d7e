// The stack machine behind read/parser_prefix.hpp.

#include "read/parser_prefix.hpp"

#include "read/foreign_words.hpp"

#include <limits>

namespace slugs {

namespace {

constexpr const char *mixed_hint =
    "operators stand before their operands here, as in '| a & b c'; an infix line must be infix throughout";

// An operator whose operands are still being read.  For a buffer `entries` are
// those read so far, of `wanted`.
struct Waiting {
  Token op;
  Lexeme lexeme;
  std::vector<FormulaId> entries;
  std::uint64_t wanted;
};

class PrefixParser {
public:
  PrefixParser(const std::vector<Lexeme> &line, Section section, const Scope &scope, FormulaPool &pool,
               Diagnostics &diagnostics)
      : line_(line), section_(section), scope_(scope), pool_(pool), diagnostics_(diagnostics) {}

  FormulaId parse() {
    while (!done_ && !failed_) {
      const Lexeme &lexeme = line_[at_++];
      switch (lexeme.token) {
      case Token::Not:
        waiting_.push_back({lexeme.token, lexeme, {}, 1});
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
    return failed_ ? pool_.constant(true) : result_;
  }

private:
  void fail(const Lexeme &lexeme, const std::string &message, const std::string &hint = "") {
    diagnostics_.error(lexeme.place, message, hint);
    failed_ = true;
  }

  void push_operator(const Lexeme &lexeme) {
    if (lexeme.hint)
      diagnostics_.error(lexeme.place, "found " + describe(lexeme), lexeme.hint);
    waiting_.push_back({lexeme.token, lexeme, {}, 2});
  }

  void incomplete(const Lexeme &end) {
    if (waiting_.empty())
      return fail(end, "found the end of the line, expected a formula");
    const Waiting &open = waiting_.back();
    fail(end, "found the end of the line, expected " +
                  std::string(open.op == Token::Dollar
                                  ? "entry " + std::to_string(open.entries.size()) + " of the buffer of " +
                                        std::to_string(open.wanted) + " opened"
                                  : "an operand of '" + std::string(open.lexeme.text) + "'") +
                  " at column " + std::to_string(open.lexeme.place.column));
  }

  // The decimal number after '$' or '?'.
  bool count(const Lexeme &after, std::uint64_t &number) {
    const Lexeme &lexeme = line_[at_];
    if (lexeme.token != Token::Number) {
      fail(lexeme,
           "found " + describe(lexeme) + ", expected a number after '" + std::string(after.text) + "'",
           "'$ n f1 ... fn' is a buffer of n formulas, '? i' recalls entry i of it");
      return false;
    }
    ++at_;
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

  void open_buffer(const Lexeme &lexeme) {
    std::uint64_t wanted;
    if (!count(lexeme, wanted))
      return;
    if (wanted == 0)
      return fail(line_[at_ - 1], "a buffer needs at least one formula: its value is the last one");
    buffers_.push_back(waiting_.size());
    waiting_.push_back({Token::Dollar, lexeme, {}, wanted});
  }

  void recall(const Lexeme &lexeme) {
    std::uint64_t index;
    if (!count(lexeme, index))
      return;
    const Lexeme &number = line_[at_ - 1];
    if (buffers_.empty())
      return fail(lexeme, "'?' outside a buffer", "a buffer is opened with '$ n'");
    const std::vector<FormulaId> &entries = waiting_[buffers_.back()].entries;
    if (index >= entries.size())
      return fail(number,
                  "entry " + std::to_string(index) + " is not known yet: the buffer has " +
                      std::to_string(entries.size()) + " so far",
                  "entries count from 0, and each may use earlier ones of the same buffer");
    operand(entries[index]);
  }

  void constant(const Lexeme &lexeme) {
    if (lexeme.text != "0" && lexeme.text != "1")
      return fail(lexeme, "found " + describe(lexeme) + ", expected a formula",
                  "the constants are 0 and 1; comparisons of integers are infix, as in x = 3");
    operand(pool_.constant(lexeme.text == "1"));
  }

  void name(const Lexeme &lexeme) {
    const ForeignWord *word =
        scope_.find(lexeme.text) ? nullptr : foreign_word(lexeme.text, ForeignWord::Operator);
    if (word && line_[at_].token != Token::End)
      return fail(lexeme, word->message(), word->hint);
    bool next = false;
    if (line_[at_].token == Token::Prime) {
      next = true;
      ++at_;
    }
    if (line_[at_].token == Token::Prime)
      return fail(line_[at_], "found a second prime", "only the current and the next value can be used");
    operand(value(lexeme, next));
  }

  FormulaId value(const Lexeme &lexeme, bool next) {
    const Symbol *symbol = scope_.find(lexeme.text);
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

  // Hands a finished formula to the operator that waits for it, and on.
  void operand(FormulaId formula) {
    while (!waiting_.empty()) {
      Waiting &top = waiting_.back();
      if (top.op == Token::Not) {
        formula = pool_.negation(formula);
      } else {
        top.entries.push_back(formula);
        if (top.entries.size() < top.wanted)
          return;
        switch (top.op) {
        case Token::And:
          formula = pool_.conjunction(top.entries[0], formula);
          break;
        case Token::Or:
          formula = pool_.disjunction(top.entries[0], formula);
          break;
        case Token::Xor:
          formula = pool_.exclusive(top.entries[0], formula);
          break;
        default:
          buffers_.pop_back(); // a buffer's value is its last entry
        }
      }
      waiting_.pop_back();
    }
    result_ = formula;
    done_ = true;
    if (line_[at_].token != Token::End)
      fail(line_[at_],
           "found " + describe(line_[at_]) + ", expected the end of the line: the formula is complete",
           line_[at_].hint ? line_[at_].hint : mixed_hint);
  }

  const std::vector<Lexeme> &line_;
  const Section section_;
  const Scope &scope_;
  FormulaPool &pool_;
  Diagnostics &diagnostics_;
  std::size_t at_ = 0;
  std::vector<Waiting> waiting_;
  std::vector<std::size_t> buffers_; // positions of the open buffers in waiting_
  FormulaId result_ = 1;
  bool done_ = false;
  bool failed_ = false;
};

} // namespace

FormulaId parse_prefix(const std::vector<Lexeme> &line, Section section, const Scope &scope,
                       FormulaPool &pool, Diagnostics &diagnostics) {
  return PrefixParser(line, section, scope, pool, diagnostics).parse();
}

} // namespace slugs
