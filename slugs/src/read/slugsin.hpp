// slugsin: its parser and its printer.

#pragma once

#include "core/specification.hpp"
#include "read/declarations.hpp"
#include "read/lexer.hpp"

#include <cstdint>
#include <deque>
#include <iosfwd>
#include <string>
#include <vector>

namespace slugs {

// Formulas of slugsin: prefix notation with memory buffers.
//
//   formula ::= ! formula | & formula formula | "|" formula formula
//             | ^ formula formula | 0 | 1 | name | name '
//             | $ n formula ... formula      n formulas, the value is the last
//             | ? i                          entry i of the innermost buffer
//
// Parsed with an explicit stack of operators that wait for operands, so that
// depth costs memory and never the call stack.

class PrefixParser {
public:
  PrefixParser(const Scope &scope, FormulaPool &pool, Diagnostics &diagnostics)
      : scope_(scope), pool_(pool), diagnostics_(diagnostics) {}

  // Return the formula of a line; after an error, which is in the diagnostics,
  // the constant true.
  FormulaId parse(Lexer &line, Section section);

private:
  // An operator that waits for operands.  A line may have millions, so nothing
  // is stored that can be recomputed.
  struct Waiting {
    Token op;
    int column;
    FormulaId held; // Not: how many in a row; And, Or, Xor: the left operand, or none
  };
  struct Buffer {
    std::vector<FormulaId> entries; // entries read so far
    std::uint64_t wanted;
  };
  static constexpr FormulaId none = 0xFFFFFFFF;

  void fail(const Lexeme &lexeme, const std::string &message, const std::string &hint = "");
  void negate(const Lexeme &lexeme);
  void push_operator(const Lexeme &lexeme);
  void incomplete(const Lexeme &end);
  bool count(const Lexeme &after, std::uint64_t &number);
  void open_buffer(const Lexeme &lexeme);
  void recall(const Lexeme &lexeme);
  void constant(const Lexeme &lexeme);
  void name(const Lexeme &lexeme);
  FormulaId value(const Symbol *symbol, const Lexeme &lexeme, bool next);
  void operand(FormulaId formula);

  const Scope &scope_;
  FormulaPool &pool_;
  Diagnostics &diagnostics_;
  Lexer *line_ = nullptr;
  Section section_ = Section::EnvInit;
  std::deque<Waiting> waiting_;
  std::vector<Buffer> buffers_; // open ones
  FormulaId result_ = 1;
  bool done_ = false;
  bool failed_ = false;
};

// Any specification as slugsin, for the tools that read only that.
//
// Variables and constraints keep their order, integers become their bits and
// range limits, and a formula that a line uses more than once is written once,
// as an entry of a memory buffer.  Reading the result gives the same game with
// the same order of variables, hence the same strategy.

void translate(const Specification &specification, std::ostream &out);

} // namespace slugs
