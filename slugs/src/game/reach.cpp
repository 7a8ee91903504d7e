// Breadth-first symbolic reachability (Burch, Clarke, McMillan, Dill and Hwang
// 1992).  Plays never leave the result, so the fixpoints of the game restricted to it
// agree there with those of the entire game.

#include "game/reach.hpp"

namespace slugs {

Bdd reachable_states(Game &game) {
  Bdd reached = game.with_alike(game.env_init & game.sys_init);
  Bdd frontier = reached;
  while (!frontier.is_false()) {
    const Bdd image = game.with_alike(game.image(frontier));
    frontier = image & !reached;
    reached |= image;
  }
  return reached;
}

Bdd without_alike(Game &game, const Bdd &reachable) {
  if (game.tells_all_apart())
    return reachable;
  return (game.env_init & game.sys_init) | game.image(reachable);
}

} // namespace slugs
