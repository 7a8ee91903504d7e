// Name lookup and the rules of the sections, see read/scope.hpp.

#include "read/scope.hpp"

#include "core/hash.hpp"
#include "read/messages/spelling.hpp"

#include <cstring>

namespace slugs {

namespace {

// Eight bytes at a time; the last ones may overlap.
std::uint64_t hash(std::string_view name) {
  const char *at = name.data();
  std::uint64_t h = name.size(), word = 0;
  if (name.size() < sizeof word) {
    for (const char c : name)
      word = word << 8 | static_cast<unsigned char>(c);
  } else {
    for (std::size_t i = 0; i + sizeof word < name.size(); i += sizeof word) {
      std::memcpy(&word, at + i, sizeof word);
      h = (h ^ word) * golden_multiplier;
      h ^= h >> 32;
    }
    std::memcpy(&word, at + name.size() - sizeof word, sizeof word);
  }
  h = (h ^ word) * golden_multiplier;
  h ^= h >> 32;
  return h * second_multiplier;
}

} // namespace

bool may_use(Section section, Owner owner, bool next) {
  switch (section) {
  case Section::EnvInit:
    return owner == Owner::Input && !next;
  case Section::SysInit:
    return !next;
  case Section::EnvTrans:
    return owner == Owner::Input || !next;
  default:
    return true;
  }
}

Scope::Scope(const Specification &specification) : specification_(specification) {
  std::size_t size = 16;
  while (size < 2 * (specification.integers.size() + specification.variables.size()))
    size *= 2;
  symbols_.resize(size);
  std::uint32_t index = 0;
  for (const Integer &integer : specification.integers) {
    add(integer.name, Symbol{true, index++});
    names_.push_back(integer.name);
  }
  index = 0;
  for (const Variable &variable : specification.variables) {
    add(variable.name, Symbol{false, index++});
    if (specification.integers.empty() || variable.name.find('@') == std::string::npos)
      names_.push_back(variable.name);
  }
}

// Where the name is, or would be.
std::size_t Scope::place_of(std::string_view name, std::uint64_t hash) const {
  std::size_t place = static_cast<std::size_t>(hash >> 32) & (symbols_.size() - 1);
  for (;; place = (place + 1) & (symbols_.size() - 1)) {
    const Entry &entry = symbols_[place];
    if (entry.name.empty() || (entry.hash == hash && entry.name == name))
      return place;
  }
}

// The first declaration counts.
void Scope::add(std::string_view name, Symbol symbol) {
  Entry &entry = symbols_[place_of(name, hash(name))];
  if (entry.name.empty())
    entry = {name, hash(name), symbol};
}

const Symbol *Scope::find(std::string_view name) const {
  const Entry &entry = symbols_[place_of(name, hash(name))];
  return entry.name.empty() ? nullptr : &entry.symbol;
}

Owner Scope::owner(const Symbol &symbol) const {
  return symbol.integer ? specification_.integers[symbol.index].owner
                        : specification_.variables[symbol.index].owner;
}

bool Scope::check_use(const Symbol &symbol, std::string_view name, Place place, Section section, bool next,
                      Diagnostics &diagnostics) const {
  const Owner owner = this->owner(symbol);
  if (may_use(section, owner, next))
    return true;
  const char *hint = "";
  if (section == Section::EnvInit && !next)
    hint = "ENV_INIT speaks of inputs only; SYS_INIT may use outputs and inputs";
  else if (section == Section::EnvInit)
    hint = "ENV_INIT speaks of current inputs; how they may change belongs in ENV_TRANS";
  else if (section == Section::SysInit)
    hint = "SYS_INIT speaks of current values; what must hold of next values belongs in SYS_TRANS";
  else
    hint = "the environment moves first: ENV_TRANS may use current values and next inputs";
  diagnostics.error(place,
                    std::string(next ? "the next value of " : "") +
                        (owner == Owner::Input ? "input '" : "output '") + printable(name) +
                        "' is not allowed in " + section_names[static_cast<std::size_t>(section)],
                    hint);
  return false;
}

void Scope::report_undeclared(std::string_view name, Place place, const std::string &hint,
                              Diagnostics &diagnostics) const {
  const auto [known, fresh] = nearest_.try_emplace(std::string(name));
  if (fresh)
    known->second = nearest_word(name, names_);
  diagnostics.error(place, "undeclared variable '" + printable(name) + "'",
                    known->second.empty() ? hint : "did you mean '" + printable(known->second) + "'?");
}

} // namespace slugs
