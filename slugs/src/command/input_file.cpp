// See command/input_file.hpp.

#include "command/input_file.hpp"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

namespace slugs {

namespace {

// A descriptor, with its name for messages.
class Input {
public:
  Input(int descriptor, std::string name) : descriptor_(descriptor), name_(std::move(name)) {
    if (descriptor_ < 0)
      fail(errno);
  }
  ~Input() {
    if (descriptor_ > STDERR_FILENO)
      ::close(descriptor_);
  }
  Input(const Input &) = delete;
  Input &operator=(const Input &) = delete;

  // Appends the next piece; false at the end.
  bool read_some(std::string &text, const Budget &budget) {
    constexpr std::size_t chunk = std::size_t{1} << 18;
    constexpr int milliseconds = 50; // between checks of the budget
    pollfd waiting{descriptor_, POLLIN, 0};
    int ready;
    do {
      budget.check();
      ready = ::poll(&waiting, 1, milliseconds);
    } while (ready == 0 || (ready < 0 && errno == EINTR));
    const std::size_t before = text.size();
    text.resize(before + chunk);
    const ssize_t got = ::read(descriptor_, text.data() + before, chunk);
    const int reason = errno;
    text.resize(before + (got > 0 ? static_cast<std::size_t>(got) : 0));
    if (got < 0)
      fail(reason);
    return got > 0;
  }

  // Size of a file; 0 for a pipe or another input without one.
  std::size_t size() const {
    struct stat status;
    return ::fstat(descriptor_, &status) == 0 && S_ISREG(status.st_mode)
               ? static_cast<std::size_t>(status.st_size)
               : 0;
  }

private:
  [[noreturn]] void fail(int reason) const {
    throw FileError("cannot read " + name_ + ": " + std::strerror(reason));
  }

  int descriptor_;
  std::string name_;
};

constexpr const char *standard_input = "standard input";

} // namespace

std::string read_file(const std::string &path, const Budget &budget) {
  const bool standard = path == "-";
  Input input(standard ? STDIN_FILENO : ::open(path.c_str(), O_RDONLY | O_CLOEXEC),
              standard ? standard_input : "'" + path + "'");
  std::string text;
  text.reserve(input.size() + (std::size_t{1} << 18));
  while (input.read_some(text, budget))
    if (text.size() > budget.memory_bytes)
      throw LimitReached(LimitKind::Memory, "memory limit reached");
  return text;
}

} // namespace slugs
