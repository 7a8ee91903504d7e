// Output of strategies.

#pragma once

#include "core/specification.hpp"

#include <charconv>
#include <cstdint>
#include <ostream>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace slugs {

// Buffer in front of a stream: strategies have millions of short tokens, and each
// stream insertion has a fixed cost.

class OutputBuffer {
public:
  explicit OutputBuffer(std::ostream &out) : out_(out) { text_.reserve(capacity + reserve); }

  OutputBuffer &operator<<(std::string_view s) {
    text_ += s;
    return *this;
  }
  OutputBuffer &operator<<(char c) {
    text_ += c;
    return *this;
  }
  template <typename Unsigned, typename = std::enable_if_t<std::is_unsigned_v<Unsigned>>>
  OutputBuffer &operator<<(Unsigned n) {
    char digits[20];
    static_assert(std::is_unsigned_v<Unsigned> && sizeof(Unsigned) <= 8); // at most 20 digits
    text_.append(digits, std::to_chars(digits, digits + sizeof digits, n).ptr);
    return *this;
  }
  // Write the text if the buffer is full; call it after a bounded number of insertions.
  void flush_if_full() {
    if (text_.size() >= capacity)
      flush();
  }
  void flush() {
    out_.write(text_.data(), static_cast<std::streamsize>(text_.size()));
    text_.clear();
  }

private:
  static constexpr std::size_t capacity = 1 << 16, reserve = 1 << 12;
  std::ostream &out_;
  std::string text_;
};

// Receiver of an explicit strategy or counterstrategy, node by node, so that a
// strategy larger than memory can be written to a file.

class StrategySink {
public:
  virtual ~StrategySink() = default;
  virtual void begin() = 0;
  // Receive a node.  Ids are consecutive from 0; initial nodes come first.  `state`: one
  // bit per variable in the order of Specification::variables.
  virtual void node(std::uint64_t id, std::uint32_t rank, const std::vector<bool> &state,
                    const std::vector<std::uint64_t> &successors) = 0;
  virtual void end() = 0;
};

// Output of an explicit strategy as JSON, in the format of SLUGS with --jsonOutput.

class JsonStrategy : public StrategySink {
public:
  JsonStrategy(const Specification &specification, std::ostream &out);
  void begin() override;
  void node(std::uint64_t id, std::uint32_t rank, const std::vector<bool> &state,
            const std::vector<std::uint64_t> &successors) override;
  void end() override;

private:
  const Specification &specification_;
  OutputBuffer out_;
  std::uint64_t nodes_ = 0; // written
};

// Output of an explicit strategy as text, in the format of SLUGS without --jsonOutput.

class TextStrategy : public StrategySink {
public:
  TextStrategy(const Specification &specification, std::ostream &out);
  void begin() override;
  void node(std::uint64_t id, std::uint32_t rank, const std::vector<bool> &state,
            const std::vector<std::uint64_t> &successors) override;
  void end() override;

private:
  std::vector<std::string> names_; // in the order of output, each with its colon
  OutputBuffer out_;
};

} // namespace slugs
