// Every value is a number, a Boolean or a fixed word, so no string needs escaping.

#include "core/statistics.hpp"

#include <sstream>

namespace slugs {

namespace {

template <typename Numbers> void list(std::ostream &out, const Numbers &numbers) {
  out << '[';
  const char *separator = "";
  for (const auto n : numbers) {
    out << separator << n;
    separator = ", ";
  }
  out << ']';
}

} // namespace

std::string to_json(const Statistics &s, const std::string &verdict) {
  std::ostringstream out;
  out.precision(9);
  out << "{\n  \"verdict\": \"" << verdict << "\",\n"
      << "  \"vacuous_win\": " << (s.vacuous_win ? "true" : "false") << ",\n"
      << "  \"variables\": " << s.variables << ",\n"
      << "  \"inputs\": " << s.inputs << ",\n"
      << "  \"outputs\": " << s.outputs << ",\n"
      << "  \"constraints\": {";
  for (std::size_t i = 0; i < section_count; ++i)
    out << (i ? ", \"" : "\"") << section_names[i] << "\": " << s.constraints[i];
  out << "},\n"
      << "  \"reachable_states\": " << s.reachable_states << ",\n"
      << "  \"iterations\": {\"safety\": " << s.safety_iterations << ", \"outer\": " << s.outer_iterations
      << ", \"y\": ";
  list(out, s.y_iterations);
  out << ", \"x\": ";
  list(out, s.x_iterations);
  out << "},\n"
      << "  \"peak_nodes\": " << s.peak_nodes << ",\n"
      << "  \"live_nodes\": " << s.live_nodes << ",\n"
      << "  \"operation_steps\": " << s.operation_steps << ",\n"
      << "  \"reordering_steps\": " << s.reordering_steps << ",\n"
      << "  \"reorderings\": " << s.reorderings << ",\n"
      << "  \"collections\": " << s.collections << ",\n"
      << "  \"memory_bytes\": " << s.memory_bytes << ",\n"
      << "  \"strategy_nodes\": " << s.strategy_nodes << ",\n"
      << "  \"strategy_edges\": " << s.strategy_edges << ",\n"
      << "  \"seconds\": {";
  for (std::size_t i = 0; i < phase_count; ++i)
    out << (i ? ", \"" : "\"") << phase_names[i] << "\": " << s.seconds[i];
  out << "}\n}\n";
  return out.str();
}

} // namespace slugs
