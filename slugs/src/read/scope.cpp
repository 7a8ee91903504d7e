// Name lookup and the rules of the sections, see read/scope.hpp.

#include "read/scope.hpp"

#include "core/hash.hpp"
#include "read/messages/spelling.hpp"

#include <cstring>

namespace slugs {

namespace {

constexpr std::size_t most_short = 7; // bytes of a name that is its own key

// The key of a short name is the name with its length; that of a longer one is a hash,
// which is not the key of a short name.  Eight bytes at a time; pieces may overlap.
std::uint64_t key_of(std::string_view name) {
  const char *at = name.data();
  const std::size_t length = name.size();
  if (length <= most_short) {
    std::uint32_t first = 0, last = 0;
    if (length >= sizeof first) {
      std::memcpy(&first, at, sizeof first);
      std::memcpy(&last, at + length - sizeof last, sizeof last);
    } else {
      for (const char c : name)
        first = first << 8 | static_cast<unsigned char>(c);
    }
    // Of the last four bytes as many are new as the length says: at most three.
    const std::uint64_t rest =
        length > sizeof first ? std::uint64_t{last} >> 8 * (2 * sizeof first - length) : 0;
    return std::uint64_t{length} << 56 | rest << 32 | first;
  }
  std::uint64_t h = length, word = 0;
  for (std::size_t i = 0; i + sizeof word < length; i += sizeof word) {
    std::memcpy(&word, at + i, sizeof word);
    h = (h ^ word) * golden_multiplier;
    h ^= h >> 32;
  }
  std::memcpy(&word, at + length - sizeof word, sizeof word);
  h = (h ^ word) * golden_multiplier;
  h ^= h >> 32;
  return h * second_multiplier | std::uint64_t{most_short + 1} << 56;
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
  for (std::uint32_t i = 0; i < specification.integers.size(); ++i)
    add(Symbol{i, true, specification.integers[i].owner});
  for (std::uint32_t i = 0; i < specification.variables.size(); ++i)
    add(Symbol{i, false, specification.variables[i].owner});
}

const std::string &Scope::name(const Symbol &symbol) const {
  return symbol.integer ? specification_.integers[symbol.index].name
                        : specification_.variables[symbol.index].name;
}

// Return the slot of the name, or the empty slot for it.
std::size_t Scope::slot_of(std::string_view name, std::uint64_t key) const {
  const std::size_t last = symbols_.size() - 1;
  for (std::size_t place = static_cast<std::size_t>(key * golden_multiplier >> 32) & last;;
       place = (place + 1) & last) {
    const Entry &entry = symbols_[place];
    if (!entry.key || (entry.key == key && (name.size() <= most_short || this->name(entry.symbol) == name)))
      return place;
  }
}

// The first declaration counts.
void Scope::add(Symbol symbol) {
  const std::uint64_t key = key_of(name(symbol));
  Entry &entry = symbols_[slot_of(name(symbol), key)];
  if (!entry.key)
    entry = {key, symbol};
}

const Symbol *Scope::find(std::string_view name) const {
  const std::uint64_t key = key_of(name);
  const Entry &entry = symbols_[slot_of(name, key)];
  return entry.key ? &entry.symbol : nullptr;
}

const std::vector<std::string> &Scope::names() const {
  if (!names_.empty())
    return names_;
  for (const Integer &integer : specification_.integers)
    names_.push_back(integer.name);
  for (const Variable &variable : specification_.variables)
    if (specification_.integers.empty() || variable.name.find('@') == std::string::npos)
      names_.push_back(variable.name);
  return names_;
}

bool Scope::check_use(const Symbol &symbol, std::string_view name, Place place, Section section, bool next,
                      Diagnostics &diagnostics) const {
  if (may_use(section, symbol.owner, next))
    return true;
  const char *hint = "";
  if (section == Section::EnvInit && !next)
    hint = "ENV_INIT refers to inputs only; SYS_INIT may use outputs and inputs";
  else if (section == Section::EnvInit)
    hint = "ENV_INIT refers to current inputs; how they may change belongs in ENV_TRANS";
  else if (section == Section::SysInit)
    hint = "SYS_INIT refers to current values; what must hold of next values belongs in SYS_TRANS";
  else
    hint = "the environment moves first: ENV_TRANS may use current values and next inputs";
  diagnostics.error(place,
                    std::string(next ? "the next value of " : "") +
                        (symbol.owner == Owner::Input ? "input '" : "output '") + printable(name) +
                        "' is not allowed in " + section_names[static_cast<std::size_t>(section)],
                    hint);
  return false;
}

void Scope::report_undeclared(std::string_view name, Place place, const std::string &hint,
                              Diagnostics &diagnostics) const {
  const auto [known, fresh] = nearest_.try_emplace(std::string(name));
  if (fresh)
    known->second = nearest_word(name, names());
  diagnostics.error(place, "undeclared variable '" + printable(name) + "'",
                    known->second.empty() ? hint : "did you mean '" + printable(known->second) + "'?");
}

} // namespace slugs
