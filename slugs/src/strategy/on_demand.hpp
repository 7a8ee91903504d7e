// The explicit strategy without a list of it: one move at a time.
//
// A position is a state with the guarantee that is pursued, as a node of the
// explicit strategy is.  Its measure is a number and perhaps an assumption: the
// first set of the fixpoint that has the state, in the order in which steps are
// taken (see allowed_moves.cpp), and the assumption that waiting in this set
// relies on.  On each move that does not meet the guarantee the number falls, or
// it stays, the assumption stays, and it is not met on this move.  So the
// caller can check each move, and a play that never meets the guarantee again
// violates an assumption forever.

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
  std::vector<bool> state; // by variable
  std::uint32_t goal;      // the guarantee that is pursued
  std::uint64_t distance;
  std::optional<std::uint32_t> assumption; // may be waited for
};

struct Move {
  Position to;
  std::uint32_t met; // how many guarantees in turn, from the one that was pursued
};

enum class Refusal {
  StateNotWinning,
  InputsNotAllowed, // by ENV_TRANS
};

class OnDemandStrategy {
public:
  OnDemandStrategy(Game &game, const Fixpoint &fixpoint);

  using Values = std::vector<std::optional<bool>>; // by variable, as far as given

  // The first initial node whose variables have these values.
  std::optional<Position> start(const Values &values);
  // The first of the first `most` nodes of the explicit strategy whose variables
  // have these values.  Nodes are met as far as that takes, and once.
  std::optional<Position> find(const Values &values, std::size_t most);
  // The successor that the explicit strategy has for these next inputs, by
  // variable; outputs are ignored.  `goal` is a guarantee.
  std::variant<Move, Refusal> move(const std::vector<bool> &state, std::uint32_t goal,
                                   const std::vector<bool> &inputs);

private:
  std::optional<std::size_t> place_of(const Values &values, std::size_t most);
  Position position(std::vector<bool> state, std::uint32_t goal) const;
  Edge input_cube(const std::vector<bool> &inputs);
  void make_room();

  Game &game_;
  const Fixpoint &fixpoint_;
  Bdd initial_;
  StrategySteps steps_;
  CollectionPause no_collection_;       // from when all of these are there
  std::optional<StrategyNodes> listed_; // since something was to be found
  std::size_t left_ = 0;                // the nodes whose successors it has met
};

} // namespace slugs
