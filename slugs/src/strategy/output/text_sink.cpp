// The layout equals that of SLUGS byte for byte.

#include "strategy/output/text_sink.hpp"

namespace slugs {

TextStrategy::TextStrategy(const Specification &specification, std::ostream &out) : out_(out) {
  for (const Variable &variable : specification.variables)
    names_.push_back(variable.name + ':');
}

void TextStrategy::begin() {}

void TextStrategy::node(std::uint64_t id, std::uint32_t rank, const std::vector<bool> &state,
                        const std::vector<std::uint64_t> &successors) {
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
