// The table behind read/messages/foreign_words.hpp.

#include "read/messages/foreign_words.hpp"

namespace slugs {

namespace {

constexpr const char *always =
    "what must always hold is a line of SYS_TRANS (guarantee) or ENV_TRANS (assumption), without 'G'";
constexpr const char *again =
    "what must happen infinitely often is a line of SYS_LIVENESS (guarantee) or ENV_LIVENESS (assumption), "
    "without 'G F'";
constexpr const char *until = "GR(1) has no until: for 'a U b' write 'a | b' in SYS_TRANS with a Boolean "
                              "output that remembers b, and b "
                              "in SYS_LIVENESS";
constexpr const char *weak_until =
    "GR(1) has no weak until: for 'a W b' write 'a | b' in SYS_TRANS with a Boolean output that remembers b";

constexpr ForeignWord words[] = {
    {"G", ForeignWord::Operator, Token::Unknown, true, always},
    {"F", ForeignWord::Operator, Token::Unknown, true, again},
    {"GF", ForeignWord::Operator, Token::Unknown, true, again},
    {"FG", ForeignWord::Operator, Token::Unknown, true,
     "GR(1) cannot ask that something holds from some time on; see SYS_LIVENESS and SYS_TRANS"},
    {"U", ForeignWord::Operator, Token::Or, true, until},
    {"W", ForeignWord::Operator, Token::Or, true, weak_until},
    {"R", ForeignWord::Operator, Token::Or, true, weak_until},
    {"and", ForeignWord::Operator, Token::And, false, "write '&'"},
    {"AND", ForeignWord::Operator, Token::And, false, "write '&'"},
    {"or", ForeignWord::Operator, Token::Or, false, "write '|'"},
    {"OR", ForeignWord::Operator, Token::Or, false, "write '|'"},
    {"xor", ForeignWord::Operator, Token::Xor, false, "write '^'"},
    {"XOR", ForeignWord::Operator, Token::Xor, false, "write '^'"},
    {"not", ForeignWord::Operator, Token::Not, false, "write '!'"},
    {"NOT", ForeignWord::Operator, Token::Not, false, "write '!'"},
    {"implies", ForeignWord::Operator, Token::Implies, false, "write '->'"},
    {"iff", ForeignWord::Operator, Token::Equivalent, false, "write '<->'"},
    {"true", ForeignWord::Constant, Token::Unknown, false, "write TRUE"},
    {"True", ForeignWord::Constant, Token::Unknown, false, "write TRUE"},
    {"false", ForeignWord::Constant, Token::Unknown, false, "write FALSE"},
    {"False", ForeignWord::Constant, Token::Unknown, false, "write FALSE"},
};

} // namespace

std::string ForeignWord::message() const {
  return (temporal ? "temporal operator '" : "found '") + std::string(text) +
         (temporal ? "' is not part of GR(1)" : "', which is not an operator here");
}

const ForeignWord *foreign_word(std::string_view word, ForeignWord::Kind kind) {
  for (const ForeignWord &entry : words)
    if (word == entry.text && (kind == ForeignWord::Any || kind == entry.kind))
      return &entry;
  return nullptr;
}

} // namespace slugs
