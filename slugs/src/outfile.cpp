// Buffered descriptors and the rename, see outfile.hpp.

#include "outfile.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace slugs {

// Writes to a file descriptor; remembers the first error, after which the
// stream is bad and everything else is dropped.
class OutFile::Buffer : public std::streambuf {
public:
  explicit Buffer(int descriptor) : descriptor_(descriptor), bytes_(std::size_t{1} << 18) {
    setp(bytes_.data(), bytes_.data() + bytes_.size());
  }

  int error() const { return error_; }
  int descriptor() const { return descriptor_; }

  void close() {
    if (descriptor_ > STDERR_FILENO && ::close(descriptor_) != 0 && error_ == 0)
      error_ = errno;
    descriptor_ = -1;
  }

protected:
  int_type overflow(int_type c) override {
    if (sync() != 0)
      return traits_type::eof();
    if (!traits_type::eq_int_type(c, traits_type::eof()))
      sputc(traits_type::to_char_type(c));
    return traits_type::not_eof(c);
  }

  int sync() override {
    const char *at = pbase();
    while (error_ == 0 && at < pptr()) {
      const ssize_t written = ::write(descriptor_, at, static_cast<std::size_t>(pptr() - at));
      if (written >= 0)
        at += written;
      else if (errno != EINTR)
        error_ = errno;
    }
    setp(bytes_.data(), bytes_.data() + bytes_.size());
    return error_ == 0 ? 0 : -1;
  }

private:
  int descriptor_;
  int error_ = 0;
  std::vector<char> bytes_;
};

namespace {

std::string resolved(const std::string &path) {
  char *real = ::realpath(path.c_str(), nullptr);
  if (!real)
    return path; // does not exist yet
  const std::string result = real;
  std::free(real);
  return result;
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
  buffer_ = std::make_unique<Buffer>(descriptor);
  stream_.rdbuf(buffer_.get());
}

OutFile::~OutFile() {
  if (buffer_->descriptor() >= 0 && path_.empty())
    stream_.flush(); // what was said on standard output stays said
  buffer_->close();
  if (!temporary_.empty())
    ::unlink(temporary_.c_str());
}

void OutFile::fail(int reason) const {
  throw WriteError("cannot write " + (path_.empty() ? std::string("to standard output") : "'" + path_ + "'") +
                   ": " + std::strerror(reason));
}

void OutFile::commit() {
  stream_.flush();
  buffer_->close();
  if (buffer_->error() != 0)
    fail(buffer_->error());
  if (stream_.bad())
    fail(EIO);
  if (!temporary_.empty()) {
    if (::rename(temporary_.c_str(), path_.c_str()) != 0)
      fail(errno);
    temporary_.clear();
  }
}

} // namespace slugs
