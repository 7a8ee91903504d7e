// Evaluation of the strategy on demand, one move at a time.
//
// A position is a state with the guarantee that is pursued, like a node of the
// explicit strategy.  Its progress measure is a number and perhaps an assumption: the
// index of the first set of the fixpoint that contains the state, in the order of steps
// (see allowed_moves.cpp), and the assumption on which waiting in this set relies.
// On each move that does not meet the guarantee, the number decreases, or number and
// assumption are unchanged and the move does not meet the assumption.  So the caller can
// check each move, and a play that never meets the guarantee again meets the
// assumption only finitely often.

#pragma once

#include "game/fixpoint.hpp"
#include "game/game.hpp"
#include "strategy/strategy_nodes.hpp"
#include "strategy/strategy_steps.hpp"

#include <cstddef>
#include <optional>
#include <variant>
#include <vector>

namespace slugs {

struct Position {
  std::vector<bool> state; // indexed by variable
  std::uint32_t goal;      // guarantee that is pursued
  std::uint64_t distance;
  std::optional<std::uint32_t> assumption; // assumption on which waiting relies
};

struct Move {
  Position to;
  std::uint32_t met; // number of consecutive guarantees met, starting with the pursued one
};

enum class Refusal {
  StateNotWinning,
  InputsNotAllowed, // by ENV_TRANS
};

class OnDemandStrategy {
public:
  OnDemandStrategy(Game &game, const Fixpoint &fixpoint);

  using Values = std::vector<std::optional<bool>>; // partial valuation, indexed by variable

  // Return the first initial node whose variables have these values.
  std::optional<Position> start(const Values &values);
  // Return the first of the first `most` nodes of the explicit strategy whose variables
  // have these values.  The search for nodes is incremental across calls.
  std::optional<Position> find(const Values &values, std::size_t most);
  // Return the successor in the explicit strategy for these next inputs.  `inputs`:
  // indexed by variable, outputs are ignored; `goal`: index of a guarantee.
  std::variant<Move, Refusal> move(const std::vector<bool> &state, std::uint32_t goal,
                                   const std::vector<bool> &inputs);

private:
  std::optional<std::size_t> position_of(const Values &values, std::size_t most);
  Position position(std::vector<bool> state, std::uint32_t goal) const;
  Edge input_cube(const std::vector<bool> &inputs);
  void collect_if_due();

  Game &game_;
  const Fixpoint &fixpoint_;
  Bdd initial_;
  StrategySteps steps_;
  CollectionPause no_collection_;         // must follow the members above
  std::optional<StrategyNodes> explored_; // since the first call of find()
  std::size_t expanded_ = 0;              // number of nodes of explored_ that are expanded
};

} // namespace slugs
