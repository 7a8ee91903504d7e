// All that it takes to go one step along the strategy.
//
// What it remembers are edges of diagrams: it lives while collections are paused
// and forgets with each that is asked for.

#pragma once

#include "game/fixpoint.hpp"
#include "game/game.hpp"
#include "strategy/allowed_moves.hpp"
#include "strategy/states/ranks.hpp"
#include "strategy/states/state_cofactor.hpp"
#include "strategy/states/successors.hpp"

#include <cstddef>

namespace slugs {

struct StrategySteps {
  StrategySteps(Game &game, const Fixpoint &fixpoint)
      : allowed(game, fixpoint), cofactor(game.store, game.guarantees),
        successors(game, Successors::Answers::Least), ranks(game.store, cofactor, game.guarantees),
        store_(game.store) {}

  // Must be called once, with collections paused, before anything else.
  void prepare() {
    allowed.prepare_cofactors();
    store_.collect();
    collect_at_ = store_.live_nodes() + (1u << 18);
  }
  // Whether the diagrams that were made on the way want to be collected.
  bool crowded() const { return store_.live_nodes() > collect_at_; }
  void forget() {
    ranks.forget();
    cofactor.forget();
    successors.forget();
    allowed.forget();
    store_.collect();
  }

  AllowedMoves allowed;
  StateCofactor cofactor;
  Successors successors;
  Ranks ranks;

private:
  BddStore &store_;
  std::size_t collect_at_ = 0;
};

} // namespace slugs
