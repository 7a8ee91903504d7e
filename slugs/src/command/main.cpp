// The command `slugs`: main(), and the operators new and delete that keep its
// memory in bounds.  Its stack is made large enough for deep diagrams.

#include "command/command.hpp"
#include "command/heap.hpp"

#include <cstdlib>
#include <new>

#include <sys/resource.h>

#ifdef __APPLE__
#include <malloc/malloc.h>
#else
#include <malloc.h>
#endif

namespace {

slugs::Heap heap; // one thread allocates

std::size_t size_of(void *block) {
#ifdef __APPLE__
  return malloc_size(block);
#else
  return malloc_usable_size(block);
#endif
}

void deallocate(void *block) {
  if (block)
    heap.used -= size_of(block);
  std::free(block);
}

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

// All forms, so that no block is allocated by one allocator and freed by another.
void *operator new(std::size_t bytes, const std::nothrow_t &) noexcept {
  const bool room = bytes <= heap.limit && heap.used <= heap.limit - bytes;
  void *block = room ? std::malloc(bytes ? bytes : 1) : nullptr;
  if (block)
    heap.used += size_of(block);
  return block;
}
void *operator new(std::size_t bytes) {
  if (void *block = operator new(bytes, std::nothrow))
    return block;
  throw std::bad_alloc();
}
void *operator new[](std::size_t bytes) { return operator new(bytes); }
void *operator new[](std::size_t bytes, const std::nothrow_t &) noexcept {
  return operator new(bytes, std::nothrow);
}
void operator delete(void *block, const std::nothrow_t &) noexcept { deallocate(block); }
void operator delete[](void *block, const std::nothrow_t &) noexcept { deallocate(block); }
void operator delete(void *block) noexcept { deallocate(block); }
void operator delete[](void *block) noexcept { deallocate(block); }
void operator delete(void *block, std::size_t) noexcept { deallocate(block); }
void operator delete[](void *block, std::size_t) noexcept { deallocate(block); }

int main(int argc, char **argv) {
  allow_deep_recursion();
  return static_cast<int>(slugs::run_command({argv + (argc > 0 ? 1 : 0), argv + argc}, heap));
}
