// The winning moves of the environment from the states that the system loses.

#pragma once

#include "game/game.hpp"

#include <vector>

namespace slugs {

class CounterFixpoint {
public:
  // `losing`: states from which the system loses: all of them, or enough for the
  // environment to win initially.
  CounterFixpoint(Game &game, const Bdd &losing, bool robotics_init);

  // Per assumption: the moves (state, next inputs) that keep the environment winning
  // and lead it towards meeting the assumption.
  const std::vector<Bdd> &moves() const { return moves_; }
  // Return the initial states that decide the game: those whose inputs lose with every
  // output, or with robotics_init all losing ones; none only if SYS_INIT allows none.
  Bdd initial();

private:
  Bdd forcing(const Bdd &targets); // moves (state, next inputs) that force a target
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
