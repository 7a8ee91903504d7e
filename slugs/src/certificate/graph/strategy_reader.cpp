// See certificate/graph/strategy_reader.hpp.

#include "certificate/graph/strategy_reader.hpp"

#include "certificate/graph/json_reader.hpp"
#include "read/messages/diagnostics.hpp"

#include <unordered_map>

namespace slugs {

namespace {

class StrategyReader {
public:
  StrategyReader(const std::string &file, std::string_view text, const Budget &budget)
      : json_(file, text, budget) {}

  ExplicitStrategy read() {
    bool has_variables = false;
    bool has_nodes = false;
    json_.object([&](const std::string &key) {
      if (key == "version") {
        if (json_.natural() != 0)
          json_.fail("unknown version of the format, expected 0");
      } else if (key == "variables" && !has_variables) {
        has_variables = true;
        json_.array([&] { strategy_.variables.push_back(json_.string()); });
      } else if (key == "nodes" && !has_nodes) {
        has_nodes = true;
        json_.object([&](const std::string &id) { node(id); });
      } else if (key == "variables" || key == "nodes") {
        json_.fail("duplicate \"" + key + "\"");
      } else {
        json_.skip();
      }
    });
    json_.end();
    if (!has_variables || !has_nodes)
      json_.fail(has_nodes ? "the strategy has no \"variables\"" : "the strategy has no \"nodes\"");
    strategy_.first_edge.push_back(strategy_.named.size());
    resolve();
    return std::move(strategy_);
  }

private:
  void node(const std::string &id) {
    if (id.empty() || id.size() > 18 || id.find_first_not_of("0123456789") != std::string::npos)
      json_.fail("found node \"" + printable(id) + "\", expected a number in quotes");
    const std::uint64_t number = std::stoull(id);
    if (!index_.emplace(number, static_cast<std::uint32_t>(strategy_.size())).second)
      json_.fail("duplicate node " + id);
    strategy_.ids.push_back(number);
    strategy_.first_bit.push_back(strategy_.bits.size());
    strategy_.first_edge.push_back(strategy_.named.size());

    bool has_rank = false, has_state = false, has_successors = false;
    json_.object([&](const std::string &key) {
      if (key == "rank" && !has_rank) {
        has_rank = true;
        strategy_.ranks.push_back(json_.natural());
      } else if (key == "state" && !has_state) {
        has_state = true;
        json_.array([&] { bit(); });
      } else if (key == "trans" && !has_successors) {
        has_successors = true;
        json_.array([&] { strategy_.named.push_back(json_.natural()); });
      } else if (key == "rank" || key == "state" || key == "trans") {
        json_.fail("node " + id + " has \"" + key + "\" twice");
      } else {
        json_.skip();
      }
    });
    if (!has_rank || !has_state || !has_successors)
      json_.fail("node " + id + " has no " +
                 (!has_rank    ? "\"rank\""
                  : !has_state ? "\"state\""
                               : "\"trans\""));
    strategy_.bit_count.push_back(
        static_cast<std::uint32_t>(strategy_.bits.size() - strategy_.first_bit.back()));
  }

  void bit() {
    const std::uint64_t value = json_.natural();
    if (value > 1)
      json_.fail("found " + std::to_string(value) + " in a state, expected 0 or 1");
    strategy_.bits.push_back(value == 1);
  }

  void resolve() {
    strategy_.successors.reserve(strategy_.named.size());
    for (const std::uint64_t id : strategy_.named) {
      const auto known = index_.find(id);
      strategy_.successors.push_back(known == index_.end() ? ExplicitStrategy::missing : known->second);
    }
  }

  JsonReader json_;
  ExplicitStrategy strategy_;
  std::unordered_map<std::uint64_t, std::uint32_t> index_;
};

} // namespace

ExplicitStrategy read_strategy(const std::string &file, std::string_view text, const Budget &budget) {
  return StrategyReader(file, text, budget).read();
}

} // namespace slugs
