// JSON (RFC 8259) as a stream of steps, without a tree of the document.
//
// The caller requests the shape that it expects, piece by piece, so that a
// strategy of millions of edges goes straight into its arrays.

#pragma once

#include "core/budget.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace slugs {

// The text is not JSON, or not of the expected shape; the message gives the
// position.
struct JsonError : Error {
  explicit JsonError(const std::string &what) : Error(ExitStatus::BadInput, what) {}
  std::string message() const override { return std::string(what()) + '\n'; }
};

class JsonReader {
public:
  // `file` is for messages; the caller keeps the text alive.
  JsonReader(std::string file, std::string_view text, const Budget &budget = Budget());

  // Calls value(key) for each member; it must read the value.
  template <class Value> void object(Value value) {
    expect('{');
    if (accept('}'))
      return;
    do {
      const std::string key = string();
      expect(':');
      value(key);
    } while (accept(','));
    expect('}');
  }
  // Calls element() for each element; it must read the element.
  template <class Element> void array(Element element) {
    expect('[');
    if (accept(']'))
      return;
    do
      element();
    while (accept(','));
    expect(']');
  }
  std::string string();
  std::uint64_t natural(); // a number without sign, fraction and exponent
  void skip();             // any value
  void end();              // nothing but white space may follow

  [[noreturn]] void fail(const std::string &message) const;

private:
  void blanks();
  bool accept(char c);
  void expect(char c);
  void skip_scalar();
  void append_escape(std::string &out);
  unsigned hex_digits();
  std::string found() const;

  std::string file_;
  std::string_view text_;
  BudgetPacer pacer_;
  std::size_t at_ = 0;
};

} // namespace slugs
