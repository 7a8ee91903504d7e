// Components for computing one step of the strategy.
//
// Their caches contain edges, so collections must be paused, and an explicit
// collection must go through forget().

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

  // Call it once, with collections paused, before all other functions.
  void prepare() {
    allowed.prepare_cofactors();
    store_.collect();
    collect_at_ = store_.live_nodes() + (1u << 18);
  }
  // Return whether temporary diagrams should be collected.
  bool should_collect() const { return store_.live_nodes() > collect_at_; }
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
