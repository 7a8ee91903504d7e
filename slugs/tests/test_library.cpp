// The public header alone: the example at its top, errors, limits, and two
// objects side by side.

#include "slugs.hpp"

#include "expect.hpp"

#include <fstream>
#include <optional>

namespace {

const char *const lift = "[INPUT]\nrequest\n[OUTPUT]\nfloor: 0...3\n[SYS_INIT]\nfloor = 0\n[SYS_TRANS]\n"
                         "floor' <= floor + 1 & floor <= floor' + 1\n[ENV_LIVENESS]\nrequest'\n"
                         "[SYS_LIVENESS]\nrequest & floor = 3\nfloor = 0\n";
const char *const hopeless = "[INPUT]\na\n[OUTPUT]\nb\n[SYS_TRANS]\n! a'\n";

template <class Exception, class Work> std::string thrown(Work work) {
  try {
    work();
  } catch (const Exception &exception) {
    return exception.what();
  }
  return "";
}

void test_the_example_of_the_header() {
  slugs::Synthesis synthesis(lift);
  EXPECT(synthesis.realizable());
  const std::string strategy = synthesis.strategy();
  EXPECT(strategy.find("\"variables\": [\"request\", \"floor@0.0.3\", \"floor@1\"]") != std::string::npos);
  EXPECT(synthesis.check_strategy(strategy).accepted);
  EXPECT(!thrown<std::logic_error>([&] { synthesis.counterstrategy(); }).empty());
  EXPECT_EQ(synthesis.warnings(), "");
  EXPECT(synthesis.statistics().find("\"verdict\": \"realizable\"") != std::string::npos);
}

// The comment at the top of the header is the program that was just tested.
void test_the_example_is_what_the_header_shows() {
  std::ifstream header("slugs/include/slugs.hpp");
  EXPECT(header.good());
  std::string text, line;
  while (std::getline(header, line) && line.rfind("//", 0) == 0) {
    const std::size_t open = line.find('"'), close = line.rfind("\\n\"");
    if (open != std::string::npos && close != std::string::npos)
      text += line.substr(open + 1, close - open - 1) + "\n";
  }
  EXPECT_EQ(text, std::string(lift));
}

void test_counterstrategies_and_their_check() {
  slugs::Synthesis synthesis(hopeless);
  EXPECT(!synthesis.realizable());
  const std::string counterstrategy = synthesis.counterstrategy();
  EXPECT(synthesis.check_counterstrategy(counterstrategy).accepted);
  const slugs::Synthesis::Check wrong = synthesis.check_strategy(counterstrategy);
  EXPECT(!wrong.accepted);
  EXPECT(!wrong.reason.empty());
  EXPECT(!thrown<std::logic_error>([&] { synthesis.strategy(); }).empty());
  EXPECT(thrown<std::invalid_argument>([&] { synthesis.check_strategy("[]"); }).find("expected '{'") !=
         std::string::npos);
}

void test_two_objects_do_not_disturb_each_other() {
  std::optional<slugs::Synthesis> one(std::in_place, lift);
  slugs::Synthesis other(hopeless);
  EXPECT(one->realizable());
  EXPECT(!other.realizable());
  const std::string before = one->strategy();
  const std::string counterstrategy = other.counterstrategy();
  slugs::Synthesis moved = std::move(*one);
  one.reset();
  EXPECT_EQ(moved.strategy(), before);
  EXPECT_EQ(other.counterstrategy(), counterstrategy);
}

void test_mistakes_are_all_in_the_exception() {
  const std::string message = thrown<slugs::InvalidSpecification>(
      [] { slugs::Synthesis("[OUTPUT]\nx:0...3\n[SYS_INIT]\nx == 1\ny\n", {}, "robot"); });
  EXPECT(message.find("robot:4:3: error") != std::string::npos);
  EXPECT(message.find("robot:5:1: error") != std::string::npos);
  slugs::Synthesis synthesis("[OUTPUT]\nx:0...3\n[SYS_INIT]\nx < 9\n");
  EXPECT(synthesis.warnings().find("always true") != std::string::npos);
}

void test_limits_stop_it() {
  const std::string endless = "[OUTPUT]\nc:0...1073741823\n[SYS_INIT]\nc = 0\n[SYS_TRANS]\nc' = c + 1\n";
  slugs::Synthesis::Settings settings;
  settings.time = std::chrono::milliseconds(50);
  slugs::Synthesis slow(endless, settings);
  EXPECT(thrown<slugs::Stopped>([&] { slow.realizable(); }).find("time limit") != std::string::npos);
  EXPECT(slow.statistics().find("\"unknown\"") != std::string::npos);

  std::atomic<bool> interrupted{true};
  settings = {};
  settings.interrupted = &interrupted;
  slugs::Synthesis interruptible(endless, settings);
  EXPECT(thrown<slugs::Stopped>([&] { interruptible.realizable(); }).find("interrupted") !=
         std::string::npos);
}

void test_translation() {
  EXPECT_EQ(slugs::Synthesis(hopeless).slugsin(),
            std::string("[INPUT]\na\n\n[OUTPUT]\nb\n\n[SYS_TRANS]\n! a'\n"));
  slugs::Synthesis synthesis(lift);
  slugs::Synthesis translated(synthesis.slugsin());
  EXPECT_EQ(translated.strategy(), synthesis.strategy());
}

} // namespace

int main() {
  return expect::run([] {
    test_the_example_of_the_header();
    test_the_example_is_what_the_header_shows();
    test_counterstrategies_and_their_check();
    test_two_objects_do_not_disturb_each_other();
    test_mistakes_are_all_in_the_exception();
    test_limits_stop_it();
    test_translation();
  });
}
