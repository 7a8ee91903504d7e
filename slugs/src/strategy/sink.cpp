// The layout equals that of SLUGS byte for byte, so that results can be compared by
// checksum.

#include "strategy/sink.hpp"

#include <cassert>

namespace slugs {

JsonStrategy::JsonStrategy(const Specification &specification, std::ostream &out)
    : specification_(specification), out_(out) {}

void JsonStrategy::begin() {
  out_ << "{\"version\": 0,\n \"slugs\": \"0.0.1\",\n\n \"variables\": [";
  std::string_view separator = "";
  for (const Variable &variable : specification_.variables) {
    out_ << separator << '"';
    for (const char c : variable.name) {
      if (c == '"' || c == '\\')
        out_ << '\\';
      out_ << c;
    }
    out_ << '"';
    separator = ", ";
  }
  out_ << "],\n\n \"nodes\": {\n";
}

void JsonStrategy::node(std::uint64_t id, std::uint32_t rank, const std::vector<bool> &state,
                        const std::vector<std::uint64_t> &successors) {
  assert(id == nodes_ && state.size() == specification_.variables.size());
  ++nodes_;
  out_ << (id ? ",\n\n\"" : "\"") << id << "\": {\n\t\"rank\": " << rank << ",\n\t\"state\": [";
  for (std::size_t k = 0; k < state.size(); ++k)
    out_ << (k ? ", " : "") << (state[k] ? '1' : '0');
  out_ << "],\n\t\"trans\": [";
  for (std::size_t k = 0; k < successors.size(); ++k) {
    if (k)
      out_ << ", ";
    out_ << successors[k];
    out_.flush_if_full();
  }
  out_ << "]\n}";
  out_.flush_if_full();
}

void JsonStrategy::end() {
  out_ << (nodes_ > 0 ? "\n\n}}\n" : "}}\n");
  out_.flush();
}

// The layout equals that of SLUGS byte for byte.

TextStrategy::TextStrategy(const Specification &specification, std::ostream &out) : out_(out) {
  for (const Variable &variable : specification.variables)
    names_.push_back(variable.name + ':');
}

void TextStrategy::begin() {}

void TextStrategy::node(std::uint64_t id, std::uint32_t rank, const std::vector<bool> &state,
                        const std::vector<std::uint64_t> &successors) {
  assert(state.size() == names_.size());
  out_ << "State " << id << " with rank " << rank << " -> <";
  for (std::size_t k = 0; k < state.size(); ++k)
    out_ << (k ? ", " : "") << names_[k] << (state[k] ? '1' : '0');
  out_ << ">\n\tWith successors : ";
  for (std::size_t k = 0; k < successors.size(); ++k) {
    if (k)
      out_ << ", ";
    out_ << successors[k];
    out_.flush_if_full();
  }
  out_ << '\n';
  out_.flush_if_full();
}

void TextStrategy::end() { out_.flush(); }

} // namespace slugs
