// The command `slugs`: main() with a stack that is large enough for deep diagrams.

#include "command/command.hpp"

#include <sys/resource.h>

namespace {

// Diagrams are as deep as there are variables, and operations on them recurse.
// The limit may be raised now: it applies whenever the main thread's stack grows.
void allow_deep_recursion() {
  constexpr rlim_t wanted = rlim_t{100} << 20;
  rlimit limit;
  if (::getrlimit(RLIMIT_STACK, &limit) != 0 || limit.rlim_cur >= wanted)
    return;
  limit.rlim_cur = limit.rlim_max < wanted ? limit.rlim_max : wanted;
  ::setrlimit(RLIMIT_STACK, &limit);
}

} // namespace

int main(int argc, char **argv) {
  allow_deep_recursion();
  return static_cast<int>(slugs::run_command({argv + (argc > 0 ? 1 : 0), argv + argc}));
}
