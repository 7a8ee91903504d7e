// The whole test framework: a suite is a list of claims, each checked with
// EXPECT or EXPECT_EQ.  A failed claim is printed with its position and values,
// and the suite continues; the program exits with status 1 if any claim failed,
// and also if none was checked, so that an empty test cannot pass.  One program
// holds all suites: compiled together, they take half of the compiler's time.

#pragma once

#include <cstdlib>
#include <exception>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <type_traits>

namespace expect {

inline int checked = 0;
inline int failed = 0;
constexpr int printed_failures = 50;

template <class T> std::string show(const T &value) {
  std::ostringstream out;
  if constexpr (std::is_same_v<T, bool>)
    out << (value ? "true" : "false");
  else if constexpr (std::is_enum_v<T>)
    out << static_cast<long long>(value);
  else
    out << value;
  return out.str();
}

inline void record(bool holds, const char *file, int line, const std::string &claim) {
  ++checked;
  if (holds)
    return;
  if (++failed <= printed_failures)
    std::cerr << file << ':' << line << ": failed: " << claim << '\n';
}

template <class A, class B>
void equal(const A &found, const B &wanted, const char *file, int line, const char *claim) {
  const bool holds = found == wanted;
  record(holds, file, line,
         holds ? std::string()
               : std::string(claim) + "\n    found:  " + show(found) + "\n    wanted: " + show(wanted));
}

using Tests = void (*)();
inline std::map<std::string, Tests> suites;

struct Suite {
  Suite(const char *name, Tests tests) { suites[name] = tests; }
};

// Runs a suite, reports and returns the exit status.
inline int run(const std::string &name) {
  try {
    suites.at(name)();
  } catch (const std::exception &e) {
    std::cerr << "a test ended with an exception: " << e.what() << '\n';
    return EXIT_FAILURE;
  }
  std::cerr << checked << " claims checked, " << failed << " failed\n";
  return checked > 0 && failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}

} // namespace expect

#define EXPECT(claim) ::expect::record(static_cast<bool>(claim), __FILE__, __LINE__, #claim)
#define EXPECT_EQ(found, wanted) ::expect::equal((found), (wanted), __FILE__, __LINE__, #found " == " #wanted)
