// Breadth-first symbolic reachability (Burch, Clarke, McMillan, Dill and Hwang
// 1992).  Plays never leave the result, so the fixpoints of the game restricted to it
// agree there with those of the entire game.

#include "game/reach.hpp"

namespace slugs {

Bdd reachable_states(Game &game) {
  Bdd reached = game.with_equivalent(game.env_init & game.sys_init);
  Bdd frontier = reached;
  while (!frontier.is_false()) {
    const Bdd image = game.with_equivalent(game.image(frontier));
    frontier = image & !reached;
    reached |= image;
  }
  return reached;
}

} // namespace slugs
