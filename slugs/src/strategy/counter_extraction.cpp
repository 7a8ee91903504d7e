// Breadth-first search of the game under the environment's strategy.

#include "strategy/counter_extraction.hpp"

#include "game/counter_fixpoint.hpp"
#include "strategy/states/node_table.hpp"
#include "strategy/states/ranks.hpp"
#include "strategy/states/state_cofactor.hpp"
#include "strategy/states/successors.hpp"

#include <string>

namespace slugs {

namespace {

class Exploration {
public:
  Exploration(Game &game, CounterFixpoint &fixpoint, bool robotics_init, StrategySink &sink,
              std::uint64_t &written)
      : game_(game), robotics_init_(robotics_init), sink_(sink), written_(written),
        nodes_(words_for(game.store.bits()), game.store.account()), initial_(fixpoint.initial()),
        functions_(functions(game, fixpoint)), cofactor_(game.store, functions_),
        successors_(game, Successors::Answers::All), ranks_(game.store, cofactor_, game.assumptions) {}

  void run() {
    BddStore &store = game_.store;
    const CollectionPause no_collection(store);
    const std::size_t collect_at = 2 * store.live_nodes() + (1u << 18);
    add_initial_nodes();
    sink_.begin();
    std::vector<bool> bits(game_.store.bits());
    std::vector<Word> state(words_for(store.bits()));
    for (std::size_t id = 0; id < nodes_.size(); ++id) {
      store.account().budget().check();
      if (store.live_nodes() > collect_at) {
        cofactor_.forget();
        successors_.forget();
        ranks_.forget();
        store.collect();
      }
      state.assign(nodes_.state(id), nodes_.state(id) + state.size());
      const std::uint32_t rank = nodes_.rank(id);
      find_successors(state.data(), rank);
      for (std::size_t k = 0; k < bits.size(); ++k)
        bits[k] = get_bit(state.data(), k);
      sink_.node(id, rank, bits, list_);
      ++written_;
    }
    sink_.end();
  }

private:
  // Return the moves for each assumption, both parts of SYS_TRANS, and the assumptions.
  static std::vector<Bdd> functions(Game &game, const CounterFixpoint &fixpoint) {
    std::vector<Bdd> result = fixpoint.moves();
    result.push_back(game.answerable);
    result.push_back(game.sys_trans);
    result.insert(result.end(), game.assumptions.begin(), game.assumptions.end());
    return result;
  }

  bool is_input(std::uint32_t bit) const { return game_.specification.variables[bit].owner == Owner::Input; }

  void add_initial_nodes() {
    Edge f = initial_.edge();
    std::vector<Word> valuation(words_for(game_.store.bits()));
    if (f == bdd_false)
      return;
    for (std::uint32_t bit = 0; bit < game_.store.bits(); ++bit)
      if (is_input(bit))
        f = fix(f, current_var(bit), valuation.data());
    meet_outputs(f, 0, valuation);
  }

  // Return the cofactor by the least possible value of v, and enter it in the valuation.
  Edge fix(Edge f, Var v, Word *valuation) {
    const Edge zero = game_.store.edges().cofactor(f, v, false);
    if (zero != bdd_false)
      return zero;
    set_bit(valuation, v / 2);
    return game_.store.edges().cofactor(f, v, true);
  }

  // Add the initial nodes with these inputs; return whether to continue the search.
  bool meet_outputs(Edge f, std::uint32_t bit, std::vector<Word> &valuation) {
    if (f == bdd_false)
      return true;
    if (bit == game_.store.bits()) {
      game_.store.account().budget().check();
      nodes_.intern(valuation.data(), 0);
      return !robotics_init_; // then one initial state suffices
    }
    if (is_input(bit))
      return meet_outputs(f, bit + 1, valuation);
    if (!meet_outputs(game_.store.edges().cofactor(f, current_var(bit), false), bit + 1, valuation))
      return false;
    set_bit(valuation.data(), bit);
    const bool go_on =
        meet_outputs(game_.store.edges().cofactor(f, current_var(bit), true), bit + 1, valuation);
    reset_bit(valuation.data(), bit);
    return go_on;
  }

  void find_successors(const Word *state, std::uint32_t rank) {
    BddStore &store = game_.store;
    list_.clear();
    Edge move = cofactor_(functions_[rank].edge(), state);
    Edge answers = store.edges().conjunction(cofactor_(game_.answerable.edge(), state),
                                             cofactor_(game_.sys_trans.edge(), state));
    std::vector<Word> input(words_for(store.bits()));
    for (std::uint32_t bit = 0; bit < store.bits(); ++bit) {
      if (!is_input(bit))
        continue;
      move = fix(move, next_var(bit), input.data());
      const bool value = get_bit(input.data(), bit);
      const Edge literal =
          store.edges().node(next_var(bit), value ? bdd_false : bdd_true, value ? bdd_true : bdd_false);
      answers = store.conjunction(Bdd(store, answers), Bdd(store, literal)).edge();
    }
    const Ranks::Step step = ranks_.from(state, rank);
    const PackedStates &found = successors_.of(answers);
    for (std::size_t k = 0; k < found.size(); ++k)
      list_.push_back(nodes_.intern(found[k], ranks_.advance(step, found[k])));
  }

  Game &game_;
  bool robotics_init_;
  StrategySink &sink_;
  std::uint64_t &written_;
  NodeTable nodes_;
  Bdd initial_;
  std::vector<Bdd> functions_;
  StateCofactor cofactor_;
  Successors successors_;
  Ranks ranks_;
  std::vector<std::uint64_t> list_;
};

} // namespace

void extract_counterstrategy(Game &game, const Bdd &losing, bool robotics_init, StrategySink &sink,
                             std::uint64_t &written) {
  CounterFixpoint fixpoint(game, losing, robotics_init);
  Exploration(game, fixpoint, robotics_init, sink, written).run();
}

} // namespace slugs
