// Breadth-first exploration of the game under the strategy.
//
// The positional strategy of a guarantee, cofactored by a state, is a function
// of next variables that says all about its successors.  Games have far more
// states than such functions, so lists of successors are remembered by function
// and rank.  Numbers of nodes are given in the order in which a first-in
// first-out search meets them; a remembered list holds only numbers that have
// been given, so remembering never changes them.

#include "strategy/extraction.hpp"

#include "strategy/allowed_moves.hpp"
#include "strategy/node_table.hpp"
#include "strategy/ranks.hpp"
#include "strategy/state_cofactor.hpp"
#include "strategy/successors.hpp"

#include <unordered_map>

namespace slugs {

namespace {

class Extraction {
public:
  Extraction(Game &game, const Fixpoint &fixpoint, std::size_t most_nodes, StrategySink &sink,
             Statistics &statistics)
      : game_(game), sink_(sink), statistics_(statistics), most_nodes_(most_nodes),
        nodes_(words_for(game.store.bits()), game.store.account()), allowed_(game, fixpoint),
        cofactor_(game.store, game.guarantees), successors_(game, Successors::Answers::Least),
        ranks_(game.store, cofactor_, game.guarantees) {}

  void run(const Bdd &winning) {
    const CollectionPause no_collection(game_.store);
    allowed_.prepare_cofactors();
    game_.store.collect();
    collect_at_ = game_.store.live_nodes() + (1u << 18);
    std::vector<Word> valuation(words_for(game_.store.bits()));
    meet_initial((winning & game_.env_init & game_.sys_init).edge(), 0, valuation);
    sink_.begin();
    std::vector<bool> bits(game_.store.bits());
    std::vector<Word> state(valuation.size());
    for (std::size_t id = 0; id < nodes_.size(); ++id) {
      if ((id & 0x3FF) == 0)
        make_room();
      state.assign(nodes_.state(id), nodes_.state(id) + state.size());
      const std::uint32_t rank = nodes_.rank(id);
      const std::vector<std::uint64_t> &list = successors(state.data(), rank);
      if (nodes_.size() > most_nodes_)
        throw LimitReached(LimitKind::Nodes, "node limit reached");
      for (std::size_t k = 0; k < bits.size(); ++k)
        bits[k] = get_bit(state.data(), k);
      sink_.node(id, rank, bits, list);
      ++statistics_.strategy_nodes;
      statistics_.strategy_edges += list.size();
    }
    sink_.end();
  }

private:
  // Variable by variable as declared, 0 before 1.
  void meet_initial(Edge f, std::uint32_t bit, std::vector<Word> &valuation) {
    if (f == bdd_false)
      return;
    if (bit == game_.store.bits()) {
      if ((nodes_.intern(valuation.data(), 0) & 0x3FF) == 0)
        game_.store.account().budget().check();
      return;
    }
    meet_initial(game_.store.cofactor_edge(f, current_var(bit), false), bit + 1, valuation);
    set_bit(valuation.data(), bit);
    meet_initial(game_.store.cofactor_edge(f, current_var(bit), true), bit + 1, valuation);
    reset_bit(valuation.data(), bit);
  }

  // Between nodes: limits, and memory that only speeds things up.
  void make_room() {
    game_.store.account().budget().check();
    if (game_.store.live_nodes() > collect_at_ || !room_to_remember()) {
      remembered_.clear();
      ranks_.forget();
      remembered_numbers_ = 0;
      cofactor_.forget();
      successors_.forget();
      allowed_.forget();
      game_.store.collect();
    }
  }

  bool room_to_remember() {
    constexpr std::size_t most = 1u << 22;
    return remembered_numbers_ < most &&
           game_.store.account().has_room(2 * remembered_numbers_ * sizeof(std::uint64_t));
  }

  const std::vector<std::uint64_t> &successors(const Word *state, std::uint32_t rank) {
    const Edge f = allowed_.transitions(state, rank);
    const Ranks::Step step = ranks_.from(state, rank);
    const auto [place, fresh] = remembered_.try_emplace(Key{f, step.rank, step.signature});
    std::vector<std::uint64_t> &list = place->second;
    if (fresh) {
      const PackedStates &found = successors_.of(f);
      list.reserve(found.size());
      for (std::size_t i = 0; i < found.size(); ++i)
        list.push_back(nodes_.intern(found[i], ranks_.advance(step, found[i])));
      remembered_numbers_ += list.size() + 8;
    }
    return list;
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
  StrategySink &sink_;
  Statistics &statistics_;
  std::size_t most_nodes_;
  NodeTable nodes_;
  AllowedMoves allowed_;
  StateCofactor cofactor_;
  Successors successors_;
  Ranks ranks_;
  std::unordered_map<Key, std::vector<std::uint64_t>, KeyHash> remembered_;
  std::size_t remembered_numbers_ = 0;
  std::size_t collect_at_ = 0;
};

} // namespace

void extract_strategy(Game &game, const Fixpoint &fixpoint, std::size_t most_nodes, StrategySink &sink,
                      Statistics &statistics) {
  Extraction(game, fixpoint, most_nodes, sink, statistics).run(fixpoint.winning());
}

} // namespace slugs
