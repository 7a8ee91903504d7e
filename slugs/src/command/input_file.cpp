// See command/input_file.hpp.

#include "command/input_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace slugs {

std::string read_file(const std::string &path) {
  const bool standard = path == "-";
  const auto fail = [&](int reason) {
    throw FileError("cannot read " + (standard ? std::string("standard input") : "'" + path + "'") + ": " +
                    std::strerror(reason));
  };
  const auto close = [](std::FILE *file) {
    if (file && file != stdin)
      std::fclose(file);
  };
  const std::unique_ptr<std::FILE, decltype(close)> file(standard ? stdin : std::fopen(path.c_str(), "rb"),
                                                         close);
  if (!file)
    fail(errno);
  std::string text;
  constexpr std::size_t chunk = std::size_t{1} << 16;
  for (std::size_t got = chunk; got == chunk;) {
    const std::size_t before = text.size();
    text.resize(before + chunk);
    got = std::fread(text.data() + before, 1, chunk, file.get());
    text.resize(before + got);
  }
  if (std::ferror(file.get()))
    fail(errno);
  return text;
}

} // namespace slugs
