// See command/serve.hpp.

#include "command/serve.hpp"

#include "certificate/graph/json_reader.hpp"
#include "core/version.hpp"
#include "read/messages/diagnostics.hpp"

#include <algorithm>
#include <functional>
#include <unordered_map>

namespace slugs {

namespace {

// The request is malformed; the message says how.
struct BadRequest {
  std::string reason;
};

class Service {
public:
  Service(const Specification &specification, OnDemandStrategy &strategy, std::ostream &out)
      : specification_(specification), strategy_(strategy), out_(out),
        guarantees_(std::max<std::size_t>(1, specification[Section::SysLiveness].size())) {
    for (std::uint32_t i = 0; i < specification.variables.size(); ++i)
      (specification.variables[i].owner == Owner::Input ? inputs_ : outputs_).push_back(i);
  }

  void greet() {
    out_ << "{\"protocol\": 1, \"slugs\": " << quoted(version) << ", \"variables\": ";
    list([this](std::size_t i) { return quoted(specification_.variables[i].name); },
         specification_.variables.size());
    out_ << ", \"inputs\": ";
    list([this](std::size_t i) { return quoted(specification_.variables[inputs_[i]].name); }, inputs_.size());
    out_ << ", \"outputs\": ";
    list([this](std::size_t i) { return quoted(specification_.variables[outputs_[i]].name); },
         outputs_.size());
    out_ << ", \"goals\": " << guarantees_
         << ", \"assumptions\": " << specification_[Section::EnvLiveness].size() << '}';
    end();
  }

  void answer(const std::string &request) {
    try {
      respond(request);
    } catch (const BadRequest &bad) {
      out_ << "{\"error\": " << quoted(bad.reason) << '}';
    } catch (const JsonError &bad) {
      out_ << "{\"error\": " << quoted(bad.what()) << '}';
    }
    end();
  }

private:
  void respond(const std::string &request) {
    std::optional<OnDemandStrategy::Values> start, wanted;
    std::optional<std::vector<bool>> state, inputs;
    std::optional<std::uint64_t> goal, nodes;
    JsonReader json("request", request);
    json.object([&](const std::string &key) {
      if (key == "start")
        start = given(json);
      else if (key == "find")
        wanted = given(json);
      else if (key == "nodes")
        nodes = json.natural();
      else if (key == "state")
        state = bits(json, specification_.variables.size(), "\"state\" needs one for each variable");
      else if (key == "inputs")
        inputs = bits(json, inputs_.size(), "\"inputs\" needs one for each input");
      else if (key == "goal")
        goal = json.natural();
      else
        throw BadRequest{"found \"" + printable(key) +
                         "\", expected start, or find and nodes, or state, goal and inputs"};
    });
    json.end();
    const bool asks_for_move = state || inputs || goal;
    if (start && !wanted && !nodes && !asks_for_move)
      return write_position(strategy_.start(*start));
    if (wanted && nodes && !start && !asks_for_move)
      return write_position(strategy_.find(*wanted, *nodes));
    if (start || wanted || nodes || !state || !inputs || !goal)
      throw BadRequest{"expected \"start\", or \"find\" and \"nodes\", or \"state\", \"goal\" and "
                       "\"inputs\""};
    if (*goal >= guarantees_)
      throw BadRequest{"goal " + std::to_string(*goal) + " does not exist: there are " +
                       std::to_string(guarantees_)};
    move(*state, static_cast<std::uint32_t>(*goal), *inputs);
  }

  void write_position(const std::optional<Position> &position) {
    if (!position) {
      out_ << "{\"state\": null}";
      return;
    }
    out_ << "{\"state\": ";
    list([&](std::size_t i) { return position->state[i] ? "1" : "0"; }, position->state.size());
    measure(*position);
    out_ << '}';
  }

  void move(const std::vector<bool> &state, std::uint32_t goal, const std::vector<bool> &next_inputs) {
    std::vector<bool> by_variable(state.size());
    for (std::size_t i = 0; i < inputs_.size(); ++i)
      by_variable[inputs_[i]] = next_inputs[i];
    const std::variant<Move, Refusal> result = strategy_.move(state, goal, by_variable);
    if (const Refusal *refusal = std::get_if<Refusal>(&result)) {
      out_ << "{\"refused\": " << (*refusal == Refusal::StateNotWinning ? "\"state\"" : "\"inputs\"") << '}';
      return;
    }
    const Move &move = std::get<Move>(result);
    out_ << "{\"outputs\": ";
    list([&](std::size_t i) { return move.to.state[outputs_[i]] ? "1" : "0"; }, outputs_.size());
    out_ << ", \"met\": " << move.met;
    measure(move.to);
    out_ << '}';
  }

  void measure(const Position &position) {
    out_ << ", \"goal\": " << position.goal << ", \"distance\": " << position.distance
         << ", \"assumption\": ";
    if (position.assumption)
      out_ << *position.assumption;
    else
      out_ << "null";
  }

  bool bit(JsonReader &json) {
    const std::uint64_t value = json.natural();
    if (value > 1)
      throw BadRequest{"found " + std::to_string(value) + ", expected 0 or 1"};
    return value == 1;
  }

  std::vector<bool> bits(JsonReader &json, std::size_t wanted, const std::string &need) {
    std::vector<bool> result;
    json.array([&] { result.push_back(bit(json)); });
    if (result.size() != wanted)
      throw BadRequest{"found " + std::to_string(result.size()) + " bits: " + need + ", " +
                       std::to_string(wanted)};
    return result;
  }

  OnDemandStrategy::Values given(JsonReader &json) {
    OnDemandStrategy::Values values(specification_.variables.size());
    json.object([&](const std::string &name) {
      const auto &variables = specification_.variables;
      const auto known = std::find_if(variables.begin(), variables.end(),
                                      [&](const Variable &variable) { return variable.name == name; });
      if (known == variables.end())
        throw BadRequest{"there is no variable '" + printable(name) + "'"};
      values[static_cast<std::size_t>(known - variables.begin())] = bit(json);
    });
    return values;
  }

  static std::string quoted(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
      if (c == '"' || c == '\\')
        result += '\\';
      result += c;
    }
    return result + '"';
  }

  template <typename Text> void list(Text text, std::size_t count) {
    out_ << '[';
    for (std::size_t i = 0; i < count; ++i)
      out_ << (i ? ", " : "") << text(i);
    out_ << ']';
  }

  void end() {
    out_ << '\n';
    out_.flush();
  }

  const Specification &specification_;
  OnDemandStrategy &strategy_;
  std::ostream &out_;
  std::size_t guarantees_;
  std::vector<std::uint32_t> inputs_, outputs_;
};

} // namespace

void serve(const Specification &specification, OnDemandStrategy &strategy, InputLines &requests,
           std::ostream &out) {
  Service service(specification, strategy, out);
  service.greet();
  std::string request;
  while (requests.next(request))
    if (request.find_first_not_of(" \t\r") != std::string::npos)
      service.answer(request);
}

} // namespace slugs
