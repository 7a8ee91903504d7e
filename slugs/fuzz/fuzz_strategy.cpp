// Fuzzes the input of --check: any bytes are not a strategy, or one that is
// accepted, or rejected with a reason.

#include "fuzz_reading.hpp"

#include "certificate/check.hpp"
#include "certificate/graph/json_reader.hpp"

namespace {

const char *const text =
    "[INPUT]\nr\n[OUTPUT]\ns\nlevel:0...2\n[SYS_INIT]\n!s\n[ENV_TRANS]\nr -> !r'\n[SYS_TRANS]\n"
    "r -> s'\nlevel' <= level + 1\n[ENV_LIVENESS]\nr'\n[SYS_LIVENESS]\ns'\nlevel = 2\n";

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
  static const slugs::Source source("fuzz", text);
  static slugs::Diagnostics diagnostics(source);
  static const slugs::Specification specification = slugs::read_specification(source, diagnostics);
  const std::string json(reinterpret_cast<const char *>(data), size);
  try {
    const slugs::ExplicitStrategy strategy = slugs::read_strategy("fuzz", json);
    for (const slugs::CertificateKind kind :
         {slugs::CertificateKind::Strategy, slugs::CertificateKind::Counterstrategy})
      for (const bool robotics : {false, true}) {
        const slugs::CheckResult result =
            slugs::check(specification, strategy, kind, robotics, slugs::Budget());
        if (result.accepted != result.reason.empty())
          fuzz::fail("a rejection without a reason", json);
      }
  } catch (const slugs::JsonError &error) {
    if (std::string(error.what()).rfind("fuzz:", 0) != 0)
      fuzz::fail("a message without a place", json);
  }
  return 0;
}
