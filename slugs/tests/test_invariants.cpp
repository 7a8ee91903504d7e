// Each internal invariant of the diagrams has an assertion that fires when it
// is broken: each is broken here, in its own process.

#include "bdd/bdd.hpp"
#include "bdd/reordering.hpp"
#include "expect.hpp"

#include <csignal>
#include <string>

#include <sys/wait.h>
#include <unistd.h>

using namespace slugs;

namespace test_invariants {
namespace {

// Return the output of a child that runs `work` before it aborts; nothing if it
// does not.
template <typename Work> std::string last_words(const Work &work) {
  int ends[2];
  if (::pipe(ends) != 0)
    return "";
  const pid_t child = ::fork();
  if (child == 0) {
    ::dup2(ends[1], STDERR_FILENO);
    std::signal(SIGABRT, SIG_DFL);
    work();
    ::_exit(0);
  }
  ::close(ends[1]);
  std::string said;
  char part[512];
  for (ssize_t got; (got = ::read(ends[0], part, sizeof part)) > 0;)
    said.append(part, static_cast<std::size_t>(got));
  ::close(ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT ? said : "";
}

// Whether `work` ends in an assertion with the text `what`.
template <typename Work> bool asserts(const std::string &what, const Work &work) {
  const std::string said = last_words([&] {
    BddStore store(3, {0, 1, 2}, Budget{});
    work(store);
  });
  return !said.empty() && said.find(what) != std::string::npos;
}

void whoever_breaks_nothing_lives() {
  EXPECT(!asserts("", [](BddStore &store) {
    SiftingLog log;
    const Bdd f = store.variable(current_var(0)) ^ store.variable(next_var(2));
    sift(store, log);
    store.collect();
    store.assert_consistent();
  }));
}

void a_node_is_above_what_it_branches_to() {
  EXPECT(asserts("level_of_var_[v] < level(low)", [](BddStore &store) {
    const Bdd upper = store.variable(current_var(0));
    store.edges().node(next_var(2), upper.edge(), bdd_true);
  }));
}

void an_edge_without_a_handle_dies_with_a_collection() {
  EXPECT(asserts("alive(", [](BddStore &store) {
    const Edge f = store.variable(current_var(0)).edge();
    const Bdd g = store.variable(current_var(1));
    store.collect();
    store.edges().conjunction(f, g.edge());
  }));
}

void a_handle_does_not_come_after_the_collection() {
  EXPECT(asserts("alive(f)", [](BddStore &store) {
    const Edge f = store.variable(current_var(0)).edge();
    store.collect();
    const Bdd late(store, f);
    SiftingLog log;
    sift(store, log);
  }));
}

void only_functions_of_the_present_move_to_the_next_state() {
  EXPECT(asserts("direction == ToNext", [](BddStore &store) { store.to_next(store.variable(next_var(1))); }));
}

void nothing_is_reordered_while_edges_are_held() {
  EXPECT(asserts("collection_allowed_", [](BddStore &store) {
    const Bdd f = store.variable(current_var(0)) ^ store.variable(current_var(2));
    const CollectionPause pause(store);
    SiftingLog log;
    sift(store, log);
  }));
}

void sifting_loses_no_edge() {
  const auto count = [](BddStore &store, bool lost) {
    const Edge f = store.variable(current_var(0)).edge();
    References references(store.account());
    references.resize_for(store.live_nodes() + 1);
    references.add(f);
    if (!lost)
      references.add(f);
    references.remove(f);
    references.remove(f);
  };
  EXPECT(!asserts("", [&](BddStore &store) { count(store, false); }));
  EXPECT(asserts("counts_[e >> 1] > 0", [&](BddStore &store) { count(store, true); }));
}

const expect::Suite suite("test_invariants", [] {
  whoever_breaks_nothing_lives();
  a_node_is_above_what_it_branches_to();
  an_edge_without_a_handle_dies_with_a_collection();
  a_handle_does_not_come_after_the_collection();
  only_functions_of_the_present_move_to_the_next_state();
  nothing_is_reordered_while_edges_are_held();
  sifting_loses_no_edge();
});

} // namespace
} // namespace test_invariants
