// Breadth-first symbolic reachability (Burch, Clarke, McMillan, Dill and Hwang
// 1992).  Plays never leave the result, so every fixpoint of the game may be
// computed within it: the values there are those of the whole game.

#include "game/reach.hpp"

namespace slugs {

Bdd reachable_states(Game &game) {
  Bdd reached = game.env_init & game.sys_init;
  Bdd frontier = reached;
  while (!frontier.is_false()) {
    const Bdd image = game.image(frontier);
    frontier = image & !reached;
    reached |= image;
  }
  return reached;
}

} // namespace slugs
