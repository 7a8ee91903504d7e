// Breadth-first search of the nodes of the strategy.
//
// Nodes are numbered in the order in which the search finds them: first the initial
// nodes, then the successors of node 0, of node 1, ...
//
// The positional strategy of a guarantee, cofactored by a state, is a function
// of next variables that determines the successors.  Games have far more states than
// such functions, so lists of successors are cached by function and rank.  A cached
// list contains only nodes that already have numbers, so caching does not affect the
// numbering.

#include "strategy/extraction.hpp"

#include "game/fixpoint.hpp"
#include "strategy/allowed_moves.hpp"
#include "strategy/states.hpp"
#include "strategy/successors.hpp"

#include <algorithm>
#include <cassert>
#include <string>
#include <unordered_map>
#include <vector>

namespace slugs {

namespace {

// The caches contain edges, so collections are paused, and an explicit collection
// clears the caches.
class Extraction {
public:
  Extraction(Game &game, const Fixpoint &fixpoint, std::size_t most_nodes)
      : game_(game), most_nodes_(most_nodes), initial_(fixpoint.winning() & game.env_init & game.sys_init),
        allowed_(game, fixpoint), cofactor_(game.store, game.guarantees),
        successors_of_(game, Successors::Answers::Least), ranks_(game.store, cofactor_, game.guarantees),
        nodes_(words_for(game.store.bits()), game.store.account()), state_(words_for(game.store.bits())),
        no_collection_(game.store) {
    assert(game.store.owns(initial_) && game.store.implies(initial_, fixpoint.winning()));
    allowed_.prepare_cofactors();
    game_.store.collect();
    collect_at_ = game_.store.live_nodes() + game_.store.tuning().garbage;
  }

  void run(StrategySink &sink, std::uint64_t &written) {
    std::vector<Word> valuation(state_.size());
    add_initial_nodes(initial_.edge(), 0, valuation);
    sink.begin();
    std::vector<bool> bits(game_.store.bits());
    assert(nodes_.size() > 0 || initial_.is_false());
    for (std::size_t id = 0; id < nodes_.size(); ++id) {
      assert(written == id); // breadth first
      if ((id & 0x3FF) == 0)
        collect_if_due();
      const std::vector<std::uint64_t> &list = successors(id);
      check_size();
      for (std::size_t k = 0; k < bits.size(); ++k)
        bits[k] = get_bit(nodes_.state(id), k);
      sink.node(id, nodes_.rank(id), bits, list);
      ++written;
    }
    sink.end();
  }

private:
  void check_size() const {
    if (nodes_.size() > most_nodes_)
      throw LimitReached(LimitKind::Nodes, "node limit reached");
  }

  // Enumerate valuations in lexicographic order of the declared variables.
  void add_initial_nodes(Edge f, std::uint32_t bit, std::vector<Word> &valuation) {
    if (f == bdd_false)
      return;
    assert(bit <= game_.store.bits());
    if (bit == game_.store.bits()) {
      assert(f == bdd_true);
      if ((nodes_.intern(valuation.data(), 0) & 0x3FF) == 0)
        game_.store.account().budget().check();
      return check_size();
    }
    add_initial_nodes(game_.store.edges().cofactor(f, current_var(bit), false), bit + 1, valuation);
    set_bit(valuation.data(), bit);
    add_initial_nodes(game_.store.edges().cofactor(f, current_var(bit), true), bit + 1, valuation);
    reset_bit(valuation.data(), bit);
  }

  // Return the numbers of the successors of a node, valid until the next call.
  const std::vector<std::uint64_t> &successors(std::size_t id) {
    // Copy the state, since interning successors may reallocate the table.
    state_.assign(nodes_.state(id), nodes_.state(id) + state_.size());
    assert(nodes_.rank(id) < game_.guarantees.size());
    const Edge f = allowed_.transitions(state_.data(), nodes_.rank(id));
    const Ranks::Step step = ranks_.from(state_.data(), nodes_.rank(id));
    const auto [place, fresh] = lists_.try_emplace(Key{f, step.rank, step.signature});
    std::vector<std::uint64_t> &list = place->second;
    if (fresh) {
      const PackedStates &found = successors_of_.of(f);
      assert(list.empty() && (found.size() > 0 || f == bdd_false));
      list.reserve(found.size());
      for (std::size_t i = 0; i < found.size(); ++i)
        list.push_back(nodes_.intern(found[i], ranks_.advance(step, found[i])));
      listed_numbers_ += list.size() + 8;
    }
    assert(std::all_of(list.begin(), list.end(), [&](std::uint64_t n) { return n < nodes_.size(); }));
    return list;
  }

  // Check the limits, and clear caches that have grown too large.
  void collect_if_due() {
    game_.store.account().budget().check();
    if (game_.store.live_nodes() <= collect_at_ && has_room_for_lists())
      return;
    assert(listed_numbers_ >= lists_.size());
    lists_.clear();
    listed_numbers_ = 0;
    ranks_.forget();
    cofactor_.forget();
    successors_of_.forget();
    allowed_.forget();
    game_.store.collect();
  }

  bool has_room_for_lists() const {
    return listed_numbers_ < game_.store.tuning().listed &&
           game_.store.account().has_room(2 * listed_numbers_ * sizeof(std::uint64_t));
  }

  struct Key {
    Edge f;
    std::uint32_t rank;
    std::uint32_t signature;
    bool operator==(const Key &o) const { return f == o.f && rank == o.rank && signature == o.signature; }
  };
  struct KeyHash {
    std::size_t operator()(const Key &k) const {
      const Word words[2] = {Word{k.f} << 32 | k.rank, k.signature};
      return static_cast<std::size_t>(hash_words(words, 2, 1));
    }
  };

  Game &game_;
  const std::size_t most_nodes_;
  const Bdd initial_;
  AllowedMoves allowed_;
  StateCofactor cofactor_;
  Successors successors_of_;
  Ranks ranks_;
  NodeTable nodes_;
  std::vector<Word> state_;
  std::unordered_map<Key, std::vector<std::uint64_t>, KeyHash> lists_;
  std::size_t listed_numbers_ = 0;
  const CollectionPause no_collection_; // must follow the members that compute diagrams
  std::size_t collect_at_ = 0;
};

} // namespace

void extract_strategy(Game &game, const Fixpoint &fixpoint, std::size_t most_nodes, StrategySink &sink,
                      std::uint64_t &written) {
  Extraction(game, fixpoint, most_nodes).run(sink, written);
}

// Breadth-first search of the game under the environment's strategy.

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
    const std::size_t collect_at = 2 * store.live_nodes() + store.tuning().garbage;
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
      assert(written_ == id && rank < game_.assumptions.size());
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

  bool is_input(std::uint32_t bit) const {
    assert(bit < game_.store.bits());
    return game_.specification.variables[bit].owner == Owner::Input;
  }

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
    assert(f != bdd_false && !get_bit(valuation, v / 2));
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
      assert(f == bdd_true);
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
    assert(rank < game_.assumptions.size());
    list_.clear();
    Edge move = cofactor_(functions_[rank].edge(), state);
    assert(move != bdd_false); // the environment has a winning move
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
    assert(move == bdd_true); // one input is left
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
  assert(game.store.owns(losing));
  CounterFixpoint fixpoint(game, losing, robotics_init);
  Exploration(game, fixpoint, robotics_init, sink, written).run();
}

} // namespace slugs
