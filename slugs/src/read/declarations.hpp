// Declarations, ranges of integers, and the names that a formula may mention.

#pragma once

#include "core/budget.hpp"
#include "core/specification.hpp"
#include "read/diagnostics.hpp"
#include "read/reader.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace slugs {

// Numbers and ranges as written in a structured file, and their limits.

// Keep sums of any length that fits in memory far inside 64 bits.
inline constexpr std::int64_t largest_number = 2147483647;

// Return the number that the digits denote; nothing if it is larger than allowed.
std::optional<std::int64_t> parse_number(std::string_view digits);
std::string out_of_range_message(std::string_view digits);

// "0...7"
std::string range_text(const Integer &integer);

// Names of the bits: x@0.min.max, x@1, x@2, ...
std::string bit_name(const Integer &integer, std::uint32_t bit);

// Return whether the bits can hold a value above max, so that a limit is needed.
bool needs_limit(const Integer &integer);

// The names that a formula may mention, by section.
//
// The environment moves first, and neither player's initial condition can look
// ahead: the variables that each section may use follow the turn order of the
// game.

struct Symbol {
  std::uint32_t index; // into Specification::integers or ::variables
  bool integer;        // else one bit
  Owner owner;
};

bool may_use(Section section, Owner owner, bool next);

class Scope {
public:
  // Take the declarations as they are now.
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
    std::uint64_t key; // 0 in an empty slot
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

// The variables of a specification.

// slugsin: one name per line, indices in the order of the file.
void declare_slugsin(const Sections &sections, const Source &source, Specification &specification,
                     Diagnostics &diagnostics, BudgetPacer &pacer);

// structuredslugs: one name, or one integer as name:min...max, per line; all
// inputs come before all outputs.  Integers become bits; if these can hold
// values beyond the range, a limit is added to the owner's INIT and TRANS.
void declare_structured(const Sections &sections, const Source &source, Specification &specification,
                        Diagnostics &diagnostics, BudgetPacer &pacer);
void limit_ranges(Specification &specification, BudgetPacer &pacer);

} // namespace slugs
