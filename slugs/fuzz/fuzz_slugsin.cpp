// Fuzzes the reader of slugsin: for any bytes it must end, with a specification
// or with messages.
//
// What it accepts must survive: printed as slugsin it must be read again, with
// the same variables and as many constraints.

#include "fuzz_reading.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size) {
  fuzz::read_and_translate(std::string(reinterpret_cast<const char *>(data), size));
  return 0;
}
