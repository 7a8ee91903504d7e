// Reading with limits; output through a temporary file.

#include "command/files.hpp"

#include <cassert>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

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

  // Append the next piece; return false at the end.
  bool read_some(std::string &text, const Budget &budget) {
    constexpr std::size_t chunk = std::size_t{1} << 18;
    constexpr int milliseconds = 50; // between checks of the budget
    pollfd waiting{descriptor_, POLLIN, 0};
    int ready;
    do {
      budget.check();
      ready = ::poll(&waiting, 1, milliseconds);
    } while (ready == 0 || (ready < 0 && errno == EINTR));
    assert(descriptor_ >= 0);
    const std::size_t before = text.size();
    text.resize(before + chunk);
    const ssize_t got = ::read(descriptor_, text.data() + before, chunk);
    const int reason = errno;
    assert(got <= static_cast<ssize_t>(chunk));
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

// Buffer of a file descriptor.  The first error throws through the stream, so
// that the writer stops; it is stored, and further output is dropped.
class OutFile::Buffer : public std::streambuf {
public:
  Buffer(int descriptor, std::string name)
      : descriptor_(descriptor), name_(std::move(name)), bytes_(std::size_t{1} << 18) {
    setp(bytes_.data(), bytes_.data() + bytes_.size());
  }

  [[noreturn]] void fail(int reason) const {
    throw WriteError("cannot write " + name_ + ": " + std::strerror(reason));
  }

  // Return 0, or the error because of which output may be lost.
  int close() {
    if (descriptor_ > STDERR_FILENO && ::close(descriptor_) != 0 && error_ == 0)
      error_ = errno;
    descriptor_ = -1;
    return error_;
  }

protected:
  int_type overflow(int_type c) override {
    sync();
    if (!traits_type::eq_int_type(c, traits_type::eof()))
      sputc(traits_type::to_char_type(c));
    return traits_type::not_eof(c);
  }

  int sync() override {
    const char *at = pbase();
    assert(at <= pptr() && pptr() <= epptr());
    while (error_ == 0 && at < pptr()) {
      const ssize_t written = ::write(descriptor_, at, static_cast<std::size_t>(pptr() - at));
      if (written >= 0)
        at += written;
      else
        error_ = errno; // EINTR too: the only handlers are those that end the run
    }
    setp(bytes_.data(), bytes_.data() + bytes_.size());
    if (error_ != 0)
      fail(error_);
    return 0;
  }

private:
  int descriptor_;
  const std::string name_;
  int error_ = 0;
  std::vector<char> bytes_;
};

namespace {

std::string resolved(const std::string &path) {
  std::error_code missing;
  const std::filesystem::path real = std::filesystem::canonical(path, missing);
  return missing ? path : real.string(); // it does not exist yet
}

[[noreturn]] void cannot_open(const std::string &path, int reason) {
  throw OpenError("cannot write '" + path + "': " + std::strerror(reason));
}

} // namespace

OutFile::OutFile(const std::string &path) : path_(path.empty() ? path : resolved(path)), stream_(nullptr) {
  int descriptor = STDOUT_FILENO;
  if (!path_.empty()) {
    struct stat status;
    const bool exists = ::stat(path_.c_str(), &status) == 0;
    if (exists && S_ISDIR(status.st_mode))
      cannot_open(path, EISDIR);
    if (exists && ::access(path_.c_str(), W_OK) != 0)
      cannot_open(path, errno);
    if (exists && !S_ISREG(status.st_mode)) {
      descriptor = ::open(path_.c_str(), O_WRONLY | O_CLOEXEC);
    } else {
      // The process id keeps two runs apart; a file of that name can only be
      // the remains of a killed run.
      temporary_ = path_ + ".part" + std::to_string(::getpid());
      descriptor = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
      if (descriptor >= 0 && exists && ::fchmod(descriptor, status.st_mode & 07777) != 0)
        errno = 0; // the mode of a file that someone else owns: keep the default
    }
    if (descriptor < 0) {
      const int reason = errno;
      temporary_.clear();
      cannot_open(path, reason);
    }
  }
  buffer_ = std::make_unique<Buffer>(descriptor, path_.empty() ? "to standard output" : "'" + path + "'");
  stream_.rdbuf(buffer_.get());
  stream_.exceptions(std::ios::badbit); // rethrows what the buffer throws
}

OutFile::~OutFile() {
  buffer_->close();
  if (!temporary_.empty())
    ::unlink(temporary_.c_str());
}

void OutFile::commit() {
  assert(buffer_);
  stream_.flush();
  if (const int reason = buffer_->close(); reason != 0)
    buffer_->fail(reason);
  if (!temporary_.empty()) {
    if (::rename(temporary_.c_str(), path_.c_str()) != 0)
      buffer_->fail(errno);
    temporary_.clear();
  }
  assert(temporary_.empty()); // nothing is left to discard
}

} // namespace slugs
