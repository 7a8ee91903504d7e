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

#include "strategy/allowed_moves.hpp"
#include "strategy/states/node_table.hpp"
#include "strategy/states/ranks.hpp"
#include "strategy/states/state_cofactor.hpp"
#include "strategy/states/successors.hpp"

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
    allowed_.prepare_cofactors();
    game_.store.collect();
    collect_at_ = game_.store.live_nodes() + (1u << 18);
  }

  void run(StrategySink &sink, std::uint64_t &written) {
    std::vector<Word> valuation(state_.size());
    add_initial_nodes(initial_.edge(), 0, valuation);
    sink.begin();
    std::vector<bool> bits(game_.store.bits());
    for (std::size_t id = 0; id < nodes_.size(); ++id) {
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
    if (bit == game_.store.bits()) {
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
    const Edge f = allowed_.transitions(state_.data(), nodes_.rank(id));
    const Ranks::Step step = ranks_.from(state_.data(), nodes_.rank(id));
    const auto [place, fresh] = lists_.try_emplace(Key{f, step.rank, step.signature});
    std::vector<std::uint64_t> &list = place->second;
    if (fresh) {
      const PackedStates &found = successors_of_.of(f);
      list.reserve(found.size());
      for (std::size_t i = 0; i < found.size(); ++i)
        list.push_back(nodes_.intern(found[i], ranks_.advance(step, found[i])));
      listed_numbers_ += list.size() + 8;
    }
    return list;
  }

  // Check the limits, and clear caches that have grown too large.
  void collect_if_due() {
    game_.store.account().budget().check();
    if (game_.store.live_nodes() <= collect_at_ && has_room_for_lists())
      return;
    lists_.clear();
    listed_numbers_ = 0;
    ranks_.forget();
    cofactor_.forget();
    successors_of_.forget();
    allowed_.forget();
    game_.store.collect();
  }

  bool has_room_for_lists() const {
    constexpr std::size_t most = 1u << 22;
    return listed_numbers_ < most &&
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

} // namespace slugs
