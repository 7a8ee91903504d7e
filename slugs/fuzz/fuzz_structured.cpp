// Fuzzes the reader of structuredslugs, as fuzz_slugsin.cpp does that of
// slugsin.  An integer declared before the bytes makes every input structured.

#include "fuzz_reading.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
  fuzz::read_and_translate("[OUTPUT]\nx:2...7\n" + std::string(reinterpret_cast<const char *>(data), size));
  return 0;
}
