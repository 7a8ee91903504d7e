// Splitting a text into lines, printing messages about it, and edit distance.

#include "read/diagnostics.hpp"

#include <algorithm>
#include <cassert>
#include <ostream>
#include <utility>

namespace slugs {

Source::Source(std::string file, std::string_view text) : file_(std::move(file)), text_(text) {
  if (text_.substr(0, 3) == "\xEF\xBB\xBF")
    text_.remove_prefix(3);
  starts_.reserve(static_cast<std::size_t>(std::count(text_.begin(), text_.end(), '\n')) + 2);
  for (std::size_t at = 0; at < text_.size();) {
    starts_.push_back(at);
    const std::size_t end = text_.find('\n', at);
    at = end == std::string_view::npos ? text_.size() : end + 1;
  }
  starts_.push_back(text_.size());
  assert(std::is_sorted(starts_.begin(), starts_.end()));
}

std::size_t foreign_length(std::string_view text) {
  const auto byte = [&](std::size_t at) {
    return at < text.size() ? static_cast<unsigned char>(text[at]) : 0u;
  };
  if ((byte(0) < 0x20 && byte(0) != '\t') || byte(0) == 0x7F)
    return 1;
  if (byte(0) == 0xC2 && byte(1) >= 0x80 && byte(1) < 0xA0)
    return 2;
  return byte(0) == 0xE2 && byte(1) == 0x80 && (byte(2) == 0xA8 || byte(2) == 0xA9) ? 3 : 0;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front()))
    text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back()))
    text.remove_suffix(1);
  return text;
}

// Collecting and printing diagnostics, see read/diagnostics.hpp.
//
// A line may be a megabyte long or contain a NUL byte.  So only a window around
// the error is shown, every byte that a terminal could misread is replaced, and
// the carets count characters, not bytes.

namespace {

constexpr std::size_t window = 100; // bytes of the source line shown
constexpr std::size_t margin = 60;  // of them at most this many before the error

// Return the length of the UTF-8 sequence at the start of `text`, 0 if it is broken.
std::size_t utf8_length(std::string_view text) {
  assert(!text.empty());
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::size_t length = byte(0) < 0x80   ? 1
                             : byte(0) < 0xC2 ? 0
                             : byte(0) < 0xE0 ? 2
                             : byte(0) < 0xF0 ? 3
                             : byte(0) < 0xF5 ? 4
                                              : 0;
  if (length == 0 || length > text.size())
    return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xC0) != 0x80)
      return 0;
  return length;
}

// Append one character of `text` to `out` in a form of width one; return the number
// of bytes consumed.
std::size_t append_character(std::string_view text, std::string &out) {
  assert(!text.empty());
  const std::size_t length = utf8_length(text);
  const unsigned char first = static_cast<unsigned char>(text[0]);
  if (first == '\t')
    out += ' ';
  else if (length == 0 || foreign_length(text) > 0)
    out += '?';
  else
    out += text.substr(0, length);
  return length == 0 ? 1 : length;
}

// Return the number of characters shown for the first `bytes` of `text`.
std::size_t shown_width(std::string_view text, std::size_t bytes) {
  std::size_t width = 0;
  std::string ignored;
  for (std::size_t i = 0; i < bytes && i < text.size(); ++width)
    i += append_character(text.substr(i), ignored);
  return width;
}

// Return the column as an editor counts it, for lines of any length: continuation
// bytes of UTF-8 do not count.
std::size_t character_column(std::string_view before) {
  const auto starts = [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; };
  return 1 + static_cast<std::size_t>(std::count_if(before.begin(), before.end(), starts));
}

} // namespace

std::string printable(std::string_view text, std::size_t most) {
  std::string out;
  std::size_t characters = 0;
  while (!text.empty()) {
    if (characters++ == most)
      return out + "...";
    text.remove_prefix(append_character(text, out));
  }
  return out;
}

void Diagnostics::error(Place place, std::string message, std::string hint) {
  assert(!message.empty() && place.line >= 0 && place.column >= 1);
  all_.push_back({Severity::Error, place, std::move(message), std::move(hint)});
  ++errors_;
}

void Diagnostics::warning(Place place, std::string message, std::string hint) {
  assert(!message.empty() && place.line >= 1 && place.column >= 1);
  all_.push_back({Severity::Warning, place, std::move(message), std::move(hint)});
}

std::vector<Diagnostic> Diagnostics::sorted() const {
  std::vector<Diagnostic> result = all_;
  std::stable_sort(result.begin(), result.end(), [](const Diagnostic &a, const Diagnostic &b) {
    return std::pair(a.place.line, a.place.column) < std::pair(b.place.line, b.place.column);
  });
  return result;
}

void Diagnostics::print(std::ostream &out, std::size_t most) const {
  std::size_t errors = 0;
  std::size_t warnings = 0;
  for (const Diagnostic &diagnostic : sorted())
    if ((diagnostic.severity == Severity::Error ? errors : warnings)++ < most)
      print_one(out, diagnostic);
  if (errors > most || warnings > most)
    out << source_.file() << ": further mistakes are not shown\n";
  if (errors > 0)
    out << source_.file() << ": " << errors << (errors == 1 ? " error\n" : " errors\n");
}

void Diagnostics::print_one(std::ostream &out, const Diagnostic &diagnostic) const {
  const Place &place = diagnostic.place;
  const bool has_line = place.line >= 1 && place.line <= source_.line_count();
  const std::string_view line = has_line ? source_.line(place.line) : std::string_view();
  const std::size_t at = std::min(static_cast<std::size_t>(place.column - 1), line.size());

  assert(at <= line.size());
  out << source_.file();
  if (has_line)
    out << ':' << place.line << ':' << character_column(line.substr(0, at));
  out << ": " << (diagnostic.severity == Severity::Error ? "error: " : "warning: ") << diagnostic.message
      << '\n';
  if (has_line) {
    std::size_t from = at > margin ? at - margin : 0;
    while (from > 0 && from < at && utf8_length(line.substr(from)) == 0)
      ++from;
    std::string shown = from > 0 ? "..." : "";
    std::string carets;
    const std::size_t marked = at + static_cast<std::size_t>(std::max(place.length, 1));
    for (std::size_t i = from; i < line.size() && i < from + window;) {
      if (i >= at && i < marked)
        carets += carets.empty() ? '^' : '~';
      i += append_character(line.substr(i), shown);
    }
    if (line.size() > from + window)
      shown += "...";
    if (carets.empty())
      carets = "^"; // just after the last character
    assert(from <= at && !carets.empty());
    const std::string number = std::to_string(place.line);
    const std::size_t indent = (from > 0 ? 3u : 0u) + shown_width(line.substr(from), at - from);
    out << "  " << number << " | " << shown << '\n';
    out << "  " << std::string(number.size(), ' ') << " | " << std::string(indent, ' ') << carets << '\n';
  }
  if (!diagnostic.hint.empty())
    out << "  hint: " << diagnostic.hint << '\n';
}

namespace {

constexpr std::size_t shortest_prefix = 4;
constexpr std::size_t longest_word = 80; // longer words get no suggestion

std::string lower(std::string_view word) {
  std::string result(word);
  for (char &c : result)
    if (c >= 'A' && c <= 'Z')
      c = static_cast<char>(c - 'A' + 'a');
  return result;
}

std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last(b.size() + 1), last(b.size() + 1), current(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j)
    last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      current[j] = std::min({last[j] + 1, current[j - 1] + 1, substituted});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        current[j] = std::min(current[j], before_last[j - 2] + 1);
    }
    std::swap(before_last, last);
    std::swap(last, current);
  }
  assert(last[b.size()] <= std::max(a.size(), b.size()));
  return last[b.size()];
}

} // namespace

std::string nearest_word(std::string_view word, const std::vector<std::string> &known) {
  if (word.size() > longest_word)
    return "";
  const std::string wanted = lower(word);
  // The only word with this prefix.
  if (word.size() >= shortest_prefix) {
    const auto begins = [&](const std::string &candidate) {
      return lower(candidate.substr(0, word.size())) == wanted;
    };
    const auto first = std::find_if(known.begin(), known.end(), begins);
    if (first != known.end() && std::find_if(first + 1, known.end(), begins) == known.end())
      return *first;
  }
  std::size_t best = std::max<std::size_t>(1, word.size() / 3) + 1;
  assert(best >= 2);
  std::string nearest;
  for (const std::string &candidate : known) {
    if (candidate.size() > word.size() + best || word.size() > candidate.size() + best)
      continue;
    const std::size_t d = distance(wanted, lower(candidate));
    if (d < best && d < std::max(word.size(), candidate.size())) {
      best = d;
      nearest = candidate;
    }
  }
  return nearest;
}

} // namespace slugs
