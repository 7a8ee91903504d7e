// How the environment wins from the states that the system loses.

#pragma once

#include "game/game.hpp"

#include <vector>

namespace slugs {

class CounterFixpoint {
public:
  // `losing` are states that the solver found the system to lose: all of them,
  // or enough to lose initially.
  CounterFixpoint(Game &game, const Bdd &losing, bool robotics_init);

  // States from which the environment is known to win.
  const Bdd &won() const { return won_; }
  // For assumption i: the moves (state, next inputs) that keep the environment
  // winning and bring it closer to satisfying assumption i.
  const std::vector<Bdd> &moves() const { return moves_; }
  // Initial states that decide the game, one for each next answer of the
  // system; empty only if SYS_INIT allows none.
  Bdd initial();

private:
  Bdd forcing(const Bdd &targets); // (state, next inputs)
  void attract();
  bool prevent(std::size_t j);
  bool decided();

  Game &game_;
  Bdd losing_;
  bool robotics_init_;
  Bdd won_;
  std::vector<Bdd> moves_;
};

} // namespace slugs
