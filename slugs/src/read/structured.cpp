// The two stacks of the parser.
//
// A syntax error ends the line, since the rest could only be guessed; a
// semantic error (an undeclared name, a comparison of Booleans) yields a value
// of unknown type, which suits every operator, and the line continues.

#include "read/structured.hpp"

#include "read/lexer.hpp"
#include "read/values.hpp"

#include <cassert>

namespace slugs {

namespace {

int precedence(Token token) {
  switch (token) {
  case Token::Equivalent:
    return 1;
  case Token::Implies:
    return 2;
  case Token::Xor:
    return 3;
  case Token::Or:
    return 4;
  case Token::And:
    return 5;
  case Token::Not:
    return 6;
  case Token::Equal:
  case Token::Unequal:
  case Token::Less:
  case Token::LessEqual:
  case Token::Greater:
  case Token::GreaterEqual:
    return comparison_precedence;
  case Token::Plus:
    return 8;
  default:
    return 0; // no operator, or an open parenthesis on the stack
  }
}

class InfixParser {
public:
  InfixParser(Lexer &line, Section section, const Scope &scope, const Specification &specification,
              FormulaPool &pool, Diagnostics &diagnostics)
      : line_(line), section_(section), scope_(scope), specification_(specification), pool_(pool),
        diagnostics_(diagnostics), algebra_(pool, diagnostics) {}

  FormulaId parse() {
    bool operand = true; // expected next, else an operator
    while (!failed_ && !done_)
      operand = operand ? read_operand() : read_operator();
    if (failed_)
      return pool_.constant(true);
    assert(values_.size() == 1 && operators_.empty() && next_depth_ == 0);
    return algebra_.boolean(values_.back());
  }

private:
  // An entry of the operator stack.
  struct Waiting {
    Token token;   // Open for a parenthesis
    bool next;     // Open: of next(...)
    Lexeme lexeme; // for messages
  };

  void fail(const Lexeme &lexeme, const std::string &expected, const std::string &hint = "") {
    diagnostics_.error(lexeme.place, "found " + describe(lexeme) + ", expected " + expected,
                       lexeme.hint ? lexeme.hint : hint);
    failed_ = true;
  }

  // Report an operator in the spelling of another language; it is then read as
  // meant.
  void report_spelling(const Lexeme &lexeme) {
    if (lexeme.hint)
      diagnostics_.error(lexeme.place, "found " + describe(lexeme), lexeme.hint);
  }

  Lexeme take() {
    before_ = last_;
    const Lexeme taken = line_.take();
    last_ = taken.token;
    return taken;
  }

  // Both return whether an operand is expected next.
  bool read_operand() {
    const Lexeme lexeme = take();
    switch (lexeme.token) {
    case Token::Not:
      report_spelling(lexeme);
      operators_.push_back({Token::Not, false, lexeme});
      return true;
    case Token::Open:
      operators_.push_back({Token::Open, false, lexeme});
      return true;
    case Token::Number:
      values_.push_back(algebra_.number(lexeme));
      return false;
    case Token::Name:
      return read_name(lexeme);
    case Token::And:
    case Token::Or:
    case Token::Xor:
    case Token::Dollar:
    case Token::Question:
      fail(lexeme, "an operand", "prefix notation must fill a line of its own, as in '| a & b c'");
      return false;
    case Token::Prime:
      fail(lexeme, "an operand", "a prime follows the variable directly, as in x'");
      return false;
    default:
      fail(lexeme, "an operand");
      return false;
    }
  }

  bool read_name(const Lexeme &lexeme) {
    const Symbol *symbol = scope_.find(lexeme.text);
    const bool opens = line_.peek().token == Token::Open;
    if ((lexeme.text == "next" || lexeme.text == "X") && (opens || !symbol)) {
      if (!opens) {
        fail(line_.peek(), "'(' after '" + std::string(lexeme.text) + "'",
             "write the next value as next(...) or with a prime, as in x'");
        return false;
      }
      if (next_depth_++ > 0)
        diagnostics_.error(lexeme.place, "next inside next(...)",
                           "only the current and the next value can be used, nothing later");
      operators_.push_back({Token::Open, true, lexeme});
      take();
      return true;
    }
    if (!symbol && (lexeme.text == "TRUE" || lexeme.text == "FALSE")) {
      values_.push_back(algebra_.constant(lexeme.text == "TRUE", lexeme.place));
      return false;
    }
    if (const ForeignWord *word = symbol ? nullptr : foreign_word(lexeme.text, ForeignWord::Operator);
        word && starts_operand(line_.peek())) {
      diagnostics_.error(lexeme.place, word->message(), word->hint);
      if (word->meaning == Token::Not)
        operators_.push_back({Token::Not, false, lexeme});
      return true; // read as if the word were not there
    }
    values_.push_back(variable(lexeme, symbol));
    return false;
  }

  static bool starts_operand(const Lexeme &lexeme) {
    return lexeme.token == Token::Name || lexeme.token == Token::Not || lexeme.token == Token::Open ||
           lexeme.token == Token::Number;
  }

  Value variable(const Lexeme &lexeme, const Symbol *symbol) {
    bool next = next_depth_ > 0;
    Place place = lexeme.place;
    if (line_.peek().token == Token::Prime) {
      const Lexeme prime = take();
      report_spelling(prime);
      if (next)
        diagnostics_.error(prime.place, "primed variable '" + printable(lexeme.text) + "' inside next(...)",
                           "next(...) already means the next value: leave the prime out");
      next = true;
      assert(prime.place.column >= place.column);
      place.length = prime.place.column + prime.place.length - place.column;
    }
    if (!symbol) {
      const ForeignWord *word = foreign_word(lexeme.text, ForeignWord::Any);
      scope_.report_undeclared(lexeme.text, lexeme.place, word ? word->hint : "", diagnostics_);
      return algebra_.unknown(place);
    }
    if (!scope_.check_use(*symbol, lexeme.text, place, section_, next, diagnostics_))
      return algebra_.unknown(place);
    return symbol->integer ? algebra_.integer(specification_.integers[symbol->index], next, place)
                           : algebra_.boolean_variable(symbol->index, next, place, lexeme.text);
  }

  bool read_operator() {
    const Lexeme lexeme = take();
    if (lexeme.token == Token::End) {
      finish(lexeme);
      return false;
    }
    if (lexeme.token == Token::Close) {
      close(lexeme);
      return false;
    }
    Token token = lexeme.token;
    if (token == Token::Name && !scope_.find(lexeme.text)) {
      if (const ForeignWord *word = foreign_word(lexeme.text, ForeignWord::Operator)) {
        diagnostics_.error(lexeme.place, word->message(), word->hint);
        token = word->meaning;
        if (precedence(token) == 0 || token == Token::Not) {
          failed_ = true;
          return false;
        }
      }
    } else if (precedence(token) > 0 && token != Token::Not) {
      report_spelling(lexeme);
    }
    if (precedence(token) == 0 || token == Token::Not) {
      std::string hint;
      if (token == Token::Prime)
        hint = before_ == Token::Prime ? "only the current and the next value can be used, nothing later"
                                       : "a prime belongs to a variable; for a formula write next(...)";
      fail(lexeme, "an operator or the end of the line", hint);
      return false;
    }
    reduce(precedence(token));
    if (precedence(token) == comparison_precedence && !operators_.empty() &&
        precedence(operators_.back().token) == comparison_precedence) {
      fail(lexeme, "a logical operator", "comparisons cannot be chained: write a <= b & b <= c");
      return false;
    }
    assert(precedence(token) > 0 && !values_.empty());
    operators_.push_back({token, false, lexeme});
    return true;
  }

  // Apply the waiting operators that bind at least as tightly as `level`;
  // comparisons wait for one that binds less, since they do not associate.
  void reduce(int level) {
    while (!operators_.empty() && operators_.back().token != Token::Open) {
      const int top = precedence(operators_.back().token);
      assert(top > 0);
      if (top < level || (top == level && level == comparison_precedence))
        return;
      apply(operators_.back());
      operators_.pop_back();
    }
  }

  void apply(const Waiting &waiting) {
    assert(values_.size() >= (waiting.token == Token::Not ? 1u : 2u));
    const Value right = std::move(values_.back());
    values_.pop_back();
    if (waiting.token == Token::Not) {
      values_.push_back(algebra_.negation(right, waiting.lexeme.place));
      return;
    }
    Value left = std::move(values_.back());
    values_.pop_back();
    values_.push_back(algebra_.binary(waiting.token, std::move(left), right, waiting.lexeme));
  }

  void close(const Lexeme &lexeme) {
    reduce(1);
    if (operators_.empty()) {
      failed_ = true;
      diagnostics_.error(lexeme.place, "found ')', but no '(' is open");
      return;
    }
    assert(operators_.back().token == Token::Open && !values_.empty());
    assert(!operators_.back().next || next_depth_ > 0);
    if (operators_.back().next)
      --next_depth_;
    Value &value = values_.back();
    const Place open = operators_.back().lexeme.place;
    value.place = {open.line, open.column, lexeme.place.column + 1 - open.column};
    operators_.pop_back();
  }

  void finish(const Lexeme &end) {
    reduce(1);
    done_ = true;
    if (operators_.empty())
      return;
    failed_ = true;
    assert(operators_.back().token == Token::Open);
    const Place open = operators_.back().lexeme.place;
    diagnostics_.error(end.place, "found the end of the line, expected ')'",
                       "the '(' at column " + std::to_string(open.column) + " is still open");
  }

  Lexer &line_;
  const Section section_;
  const Scope &scope_;
  const Specification &specification_;
  FormulaPool &pool_;
  Diagnostics &diagnostics_;
  ValueAlgebra algebra_;
  Token before_ = Token::End; // of the lexeme before the one taken last
  Token last_ = Token::End;
  std::vector<Value> values_;
  std::vector<Waiting> operators_;
  int next_depth_ = 0;
  bool failed_ = false;
  bool done_ = false;
};

} // namespace

FormulaId parse_infix(Lexer &line, Section section, const Scope &scope, const Specification &specification,
                      FormulaPool &pool, Diagnostics &diagnostics) {
  return InfixParser(line, section, scope, specification, pool, diagnostics).parse();
}

} // namespace slugs
