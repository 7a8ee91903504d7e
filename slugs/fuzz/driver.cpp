// A fuzzing loop for compilers without libFuzzer: deterministic mutations of
// seed texts, bounded by a count and by seconds.
//
//   fuzz_NAME [--runs N] [--seconds S] [--seed N] [FILE...]
//
// Files are added to the built-in seeds.  A finding is a text on which the
// sanitizers or the target abort; fuzz-finding.txt then contains it.

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t *data, std::size_t size);

namespace {

const char *const seeds[] = {
    "[INPUT]\na\n[OUTPUT]\nb\nc\n[ENV_INIT]\n! a\n[SYS_INIT]\n& b ! c\n[ENV_TRANS]\n| a a'\n"
    "[SYS_TRANS]\n$ 3 ^ a b' & ? 0 c | ? 1 ! ? 0\n^ b' | a c'\n[ENV_LIVENESS]\na'\n[SYS_LIVENESS]\nb\n! c'\n",
    "[INPUT]\ny:0...5\nr\n[OUTPUT]\nz:3...9\nb\n[ENV_INIT]\ny = 0 & !r\n[SYS_INIT]\nz >= 4\n"
    "[ENV_TRANS]\nr -> y' <= y + 1\n[SYS_TRANS]\nnext(z = y) <-> b || (z' + 1 != y /\\ TRUE)\n| ! r b'\n"
    "[SYS_LIVENESS]\nz' = 9 ^ X(b)\n",
    "# comment\n[OUTPUT]\none:4...4\n[SYS_LIVENESS]\none = 4 --> FALSE\n",
    "[SYS_TRANS]\nG F a U b\nx == 3 - 2\n(((\n",
};

// Words that random bytes would hardly ever form.
const char *const words[] = {"[INPUT]\n",
                             "[OUTPUT]\n",
                             "[SYS_TRANS]\n",
                             "[SYS_INIT]\n",
                             "next(",
                             "X(",
                             "TRUE",
                             "FALSE",
                             "...",
                             "->",
                             "<->",
                             "<=",
                             "!=",
                             "$ 2 ",
                             "? 0 ",
                             "'",
                             "\r\n",
                             "\xEF\xBB\xBF",
                             "a",
                             "b",
                             "x",
                             "x:0...3\n",
                             "(",
                             ")",
                             "#",
                             "| ",
                             "& ",
                             "2147483647",
                             ", ",
                             "0",
                             "1",
                             "{",
                             "}",
                             "]",
                             "[1, 2]",
                             "\\u00e9",
                             "\"trans\": ",
                             "\n",
                             " "};

std::string current;

std::string mutated(const std::vector<std::string> &corpus, std::mt19937_64 &random) {
  std::string text = corpus[random() % corpus.size()];
  const auto place = [&] { return static_cast<std::size_t>(random() % (text.size() + 1)); };
  for (std::uint64_t steps = 1 + random() % 8; steps > 0; --steps) {
    const std::size_t at = place();
    switch (random() % 7) {
    case 0:
      text.insert(at, 1, static_cast<char>(random() % 256));
      break;
    case 1:
      text.insert(at, words[random() % (sizeof words / sizeof *words)]);
      break;
    case 2:
      text.erase(at, random() % 8);
      break;
    case 3:
      if (at < text.size())
        text[at] = static_cast<char>(text[at] ^ (1 << random() % 8));
      break;
    case 4:
      text.insert(at, text.substr(place(), random() % 40));
      break;
    case 5: {
      const std::string &other = corpus[random() % corpus.size()];
      text.insert(at, other.substr(static_cast<std::size_t>(random() % (other.size() + 1)), random() % 80));
      break;
    }
    default: // a short piece many times: depth and length
      if (random() % 16 == 0) {
        const std::string piece = text.substr(at, 1 + random() % 4);
        for (std::uint64_t times = random() % 2000; times > 0; --times)
          text.insert(at, piece);
      }
    }
  }
  return text;
}

void keep_finding(int) {
  if (std::FILE *file = std::fopen("fuzz-finding.txt", "wb")) {
    std::fwrite(current.data(), 1, current.size(), file);
    std::fclose(file);
  }
  std::_Exit(1);
}

} // namespace

extern "C" const char *__asan_default_options() { return "handle_abort=0:abort_on_error=1"; }

int main(int argc, char **argv) {
  std::uint64_t runs = 100000;
  double seconds = 1e9;
  std::uint64_t seed = 1;
  std::vector<std::string> corpus(std::begin(seeds), std::end(seeds));
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument.rfind("--", 0) == 0 && i + 1 < argc) {
      const char *value = argv[++i];
      if (argument == "--runs")
        runs = std::strtoull(value, nullptr, 10);
      else if (argument == "--seconds")
        seconds = std::strtod(value, nullptr);
      else if (argument == "--seed")
        seed = std::strtoull(value, nullptr, 10);
      continue;
    }
    std::ifstream file(argument, std::ios::binary);
    if (!file) {
      std::cerr << "cannot read " << argument << '\n';
      return 2;
    }
    corpus.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  std::signal(SIGABRT, keep_finding);
  std::mt19937_64 random(seed);
  const auto start = std::chrono::steady_clock::now();
  std::uint64_t done = 0;
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  for (; done < runs && (done % 64 != 0 || elapsed() < seconds); ++done) {
    current = done < corpus.size() ? corpus[done] : mutated(corpus, random);
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t *>(current.data()), current.size());
  }
  std::cerr << done << " runs in " << elapsed() << " s, no finding\n";
  return 0;
}
