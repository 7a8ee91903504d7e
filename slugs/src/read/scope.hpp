// The names that a formula may mention, by section.
//
// The environment moves first, and neither player's initial condition can look
// ahead: the variables that each section may use follow the turn order of the
// game.

#pragma once

#include "core/specification.hpp"
#include "read/messages/diagnostics.hpp"

#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace slugs {

struct Symbol {
  std::uint32_t index; // into Specification::integers or ::variables
  bool integer;        // else one bit
  Owner owner;
};

bool may_use(Section section, Owner owner, bool next);

class Scope {
public:
  // Takes the declarations as they are now.
  explicit Scope(const Specification &specification);

  const Symbol *find(std::string_view name) const;

  // Check a use of a declared name; report it if the section forbids it.
  bool check_use(const Symbol &symbol, std::string_view name, Place place, Section section, bool next,
                 Diagnostics &diagnostics) const;
  // Report an undeclared name; suggest a near one, else `hint`.
  void report_undeclared(std::string_view name, Place place, const std::string &hint,
                         Diagnostics &diagnostics) const;

private:
  struct Entry {
    std::uint64_t key; // 0 in an empty place
    Symbol symbol;
  };
  std::size_t slot_of(std::string_view name, std::uint64_t key) const;
  void add(Symbol symbol);
  const std::vector<std::string> &names() const;
  const std::string &name(const Symbol &symbol) const;

  const Specification &specification_;
  // Open addressing, since half of the text of a long file is names.
  std::vector<Entry> symbols_;
  mutable std::vector<std::string> names_; // as declared, once a suggestion is needed
  mutable std::unordered_map<std::string, std::string> nearest_;
};

} // namespace slugs
