// Headings, see read/sections.hpp.

#include "read/sections.hpp"

#include "read/messages/spelling.hpp"

#include <cstdio>
#include <optional>

namespace slugs {

namespace {

// The kind of section to which the next lines belong.
enum class Part { BeforeFirst, Unknown, Declarations, Constraints };

struct Heading {
  Part part = Part::Unknown;
  Owner owner = Owner::Input;
  Section section = Section::EnvInit;
};

std::optional<Heading> heading(std::string_view name) {
  if (name == "INPUT" || name == "OUTPUT")
    return Heading{Part::Declarations, name == "INPUT" ? Owner::Input : Owner::Output, Section::EnvInit};
  for (std::size_t i = 0; i < section_count; ++i)
    if (name == section_names[i])
      return Heading{Part::Constraints, Owner::Input, static_cast<Section>(i)};
  return std::nullopt;
}

std::vector<std::string> heading_names() {
  std::vector<std::string> names = {"INPUT", "OUTPUT"};
  names.insert(names.end(), section_names.begin(), section_names.end());
  return names;
}

std::string hint_for(const std::string &nearest) {
  if (!nearest.empty())
    return "did you mean [" + nearest + "]?";
  std::string all;
  for (const std::string &known : heading_names())
    all += (all.empty() ? "[" : " [") + known + "]";
  return "the sections are " + all;
}

Heading read_heading(std::string_view line, int number, Diagnostics &diagnostics) {
  const std::string_view text = trimmed(line);
  const int column = static_cast<int>(text.data() - line.data()) + 1;
  const std::size_t close = text.find(']');
  if (close == std::string_view::npos) {
    diagnostics.error({number, column + static_cast<int>(text.size()), 1},
                      "found the end of the line, expected ']' after the name of the section");
  } else if (close + 1 < text.size()) {
    diagnostics.error(
        {number, column + static_cast<int>(close) + 1, static_cast<int>(text.size() - close) - 1},
        "found '" + printable(trimmed(text.substr(close + 1))) +
            "' behind a section heading, expected the end of the line");
  }
  const std::string_view name =
      trimmed(text.substr(1, close == std::string_view::npos ? std::string_view::npos : close - 1));
  if (const std::optional<Heading> known = heading(name))
    return *known;
  const std::string nearest = nearest_word(name, heading_names());
  diagnostics.error({number, column, static_cast<int>(text.size())},
                    "unknown section [" + printable(name) + "]", hint_for(nearest));
  // Its lines are read as those of the section that was probably meant, so that
  // they cause no errors of their own.
  return heading(nearest).value_or(Heading{});
}

// Whether a line contains no character on which programs disagree: behind one,
// this program's comment may be another's formula.
bool is_one_line(std::string_view line, int number, Diagnostics &diagnostics) {
  for (std::size_t at = 0; at < line.size(); ++at)
    if (const std::size_t length = foreign_length(line.substr(at))) {
      const unsigned last = static_cast<unsigned char>(line[at + length - 1]);
      char name[8];
      std::snprintf(name, sizeof name, "U+%04X", length == 3 ? 0x2000 | (last & 0x3F) : last);
      diagnostics.error({number, static_cast<int>(at) + 1, static_cast<int>(length)},
                        std::string("not text: the character ") + name,
                        "remove it: programs do not agree on whether a line ends there");
      return false;
    }
  return true;
}

} // namespace

Sections read_sections(const Source &source, Diagnostics &diagnostics) {
  Sections sections;
  Heading current{Part::BeforeFirst};
  bool empty = true;
  for (int number = 1; number <= source.line_count(); ++number) {
    const std::string_view line = source.line(number);
    if (!is_one_line(line, number, diagnostics))
      continue;
    const std::string_view text = trimmed(line);
    if (text.empty() || text.front() == '#')
      continue;
    empty = false;
    if (text.front() == '[' && text.substr(0, 2) != "[]") { // else it is an operator of LTL
      current = read_heading(line, number, diagnostics);
      continue;
    }
    switch (current.part) {
    case Part::BeforeFirst:
      diagnostics.error(
          {number, static_cast<int>(text.data() - line.data()) + 1, static_cast<int>(text.size())},
          "found '" + printable(text) + "' before the first section",
          "begin with [INPUT] or [OUTPUT]; a comment starts with '#'");
      break;
    case Part::Unknown:
      break;
    case Part::Declarations:
      sections.declarations.push_back({current.owner, number});
      break;
    case Part::Constraints:
      sections.constraints[static_cast<std::size_t>(current.section)].push_back(number);
    }
  }
  if (empty)
    diagnostics.error({}, source.line_count() == 0 ? "the file is empty" : "the file holds no specification",
                      "expected sections such as [INPUT], [OUTPUT] and [SYS_TRANS]");
  return sections;
}

} // namespace slugs
