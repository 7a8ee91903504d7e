// Name lookup and the rules of the sections, see read/scope.hpp.

#include "read/scope.hpp"

#include "read/messages/spelling.hpp"

namespace slugs {

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
  std::uint32_t index = 0;
  for (const Integer &integer : specification.integers) {
    symbols_.emplace(integer.name, Symbol{true, index++});
    names_.push_back(integer.name);
  }
  index = 0;
  for (const Variable &variable : specification.variables) {
    symbols_.emplace(variable.name, Symbol{false, index++});
    if (specification.integers.empty() || variable.name.find('@') == std::string::npos)
      names_.push_back(variable.name);
  }
}

const Symbol *Scope::find(std::string_view name) const {
  const auto place = symbols_.find(name);
  return place == symbols_.end() ? nullptr : &place->second;
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
