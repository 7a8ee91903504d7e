// Fuzzes a reader: for any bytes it must end, with a specification or with messages.
//
// An accepted text, printed as slugsin, must be read again with the same variables and as
// many constraints.  Two programs differ in what they put before
// the bytes, `prefix.cpp`.

#include "read/reader.hpp"
#include "read/slugsin.hpp"

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <sstream>
#include <string>

extern const char *const prefix;

namespace fuzz {

[[noreturn]] inline void fail(const std::string &what, const std::string &text) {
  std::cerr << "finding: " << what << "\n--- text\n" << text << "\n---\n";
  std::abort();
}

// A limit ends reading immediately, and in no other way than by LimitReached.
inline void read_within_no_time(const slugs::Source &source, const std::string &text) {
  const std::atomic<bool> interrupted{true};
  slugs::Budget budget;
  budget.interrupted = &interrupted;
  slugs::Diagnostics diagnostics(source);
  try {
    slugs::read_specification(source, diagnostics, budget);
  } catch (const slugs::LimitReached &) {
    return;
  }
  fail("reading continues after an interrupt", text);
}

// One run: read, print all messages, translate, read again.
inline void read_and_translate(const std::string &text) {
  const slugs::Source source("fuzz", text);
  read_within_no_time(source, text);
  slugs::Diagnostics diagnostics(source);
  const slugs::Specification specification = slugs::read_specification(source, diagnostics);
  std::ostringstream messages;
  diagnostics.print(messages);
  if (diagnostics.error_count() > 0) {
    if (messages.str().empty())
      fail("errors without a message", text);
    return;
  }
  std::ostringstream printed;
  slugs::translate(specification, printed);
  // Read the translation. Its language is detected by its content, in which a name of
  // slugsin may be TRUE, or look like a comment or a section.
  const std::string copied_text = printed.str();
  const slugs::Source copied_source("copy", copied_text);
  slugs::Diagnostics copied_diagnostics(copied_source);
  const slugs::Specification copy = slugs::read_specification(copied_source, copied_diagnostics);
  copied_diagnostics.print(messages);
  if (copied_diagnostics.error_count() > 0)
    fail("the translation is not read: " + messages.str() + printed.str(), text);
  if (copy.variables.size() != specification.variables.size())
    fail("the translation has other variables:\n" + printed.str(), text);
  for (std::size_t i = 0; i < copy.variables.size(); ++i)
    if (copy.variables[i].name != specification.variables[i].name)
      fail("the translation has other names:\n" + printed.str(), text);
  for (std::size_t i = 0; i < slugs::section_count; ++i)
    if (copy.constraints[i].size() != specification.constraints[i].size())
      fail("the translation has other constraints:\n" + printed.str(), text);
}

} // namespace fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
  fuzz::read_and_translate(prefix + std::string(reinterpret_cast<const char *>(data), size));
  return 0;
}
