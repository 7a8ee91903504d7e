"""A second formulation of GR(1): a parity game with three colours, by Zielonka's algorithm.

One counter walks round the guarantees, one round the assumptions; a node is 2 when the guarantees'
counter has just completed a round, 1 when only the assumptions' has, else 0.  The system wins iff
the greatest colour seen infinitely often is even.  This shares no fixpoint with fixpoint.py, and
it gives a strategy to whoever wins (W. Zielonka, Infinite games on finitely coloured graphs, 1998).
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from oracle.automaton import Automaton, Node
from oracle.game import Game, members

SYSTEM, ENVIRONMENT = 0, 1


@dataclass(frozen=True)
class Place:
    """The environment is to move: a state, both counters, and the colour of arriving here."""

    state: int
    assumption: int
    guarantee: int
    colour: int


@dataclass(frozen=True)
class Question:
    """The system is to answer these inputs (a set of states that share them)."""

    place: Place
    inputs: int


Vertex = Place | Question
_Follow = Callable[[Place], list[Place]]


@dataclass
class ParityGame:
    owner: dict[Vertex, int] = field(default_factory=dict)
    colour: dict[Vertex, int] = field(default_factory=dict)
    successors: dict[Vertex, list[Vertex]] = field(default_factory=dict)
    predecessors: dict[Vertex, list[Vertex]] = field(default_factory=dict)


@dataclass(frozen=True)
class ParitySolution:
    game: Game
    won_by: dict[Vertex, int]
    choice: dict[Vertex, Vertex]  # for vertices won by their owner

    def winning_states(self) -> int:
        return sum(1 << s for s in self.game.states if self.won_by[start(s)] == SYSTEM)


def start(state: int) -> Place:
    return Place(state, 0, 0, 0)


def solve_parity(game: Game) -> ParitySolution:
    """Who wins from each state, and how."""
    arena = ParityGame()
    pending = [start(state) for state in game.states]
    while pending:
        place = pending.pop()
        if place in arena.owner:
            continue
        questions = [Question(place, inputs) for inputs in game.moves[place.state]]
        _add(arena, place, ENVIRONMENT, place.colour, list(questions))
        for question in questions:
            answers = [
                _arrive(game, place, t) for t in members(game.moves[place.state][question.inputs])
            ]
            _add(arena, question, SYSTEM, 0, list(answers))
            pending += answers
    winners, choice = _solve(arena)
    return ParitySolution(game, winners, choice)


def strategy_from_parity(solution: ParitySolution, states: int) -> Automaton:
    """A strategy of the system from these winning states; the counters are its memory."""
    game = solution.game

    def follow(place: Place) -> list[Place]:
        questions = [Question(place, inputs) for inputs in game.moves[place.state]]
        return [_place(solution.choice[question]) for question in questions]

    return _unfold(solution, [start(s) for s in members(states)], follow)


def counterstrategy_from_parity(solution: ParitySolution, states: int) -> Automaton:
    """A strategy of the environment from these losing states."""
    game = solution.game

    def follow(place: Place) -> list[Place]:
        question = solution.choice[place]
        assert isinstance(question, Question)
        answers = game.moves[place.state][question.inputs]
        return [_arrive(game, place, t) for t in members(answers)]

    return _unfold(solution, [start(s) for s in members(states)], follow)


def _place(vertex: Vertex) -> Place:
    assert isinstance(vertex, Place)
    return vertex


def _unfold(solution: ParitySolution, starts: list[Place], follow: _Follow) -> Automaton:
    numbers = {place: number for number, place in enumerate(starts)}
    queue = list(starts)
    nodes = []
    for place in queue:  # grows while it is walked
        successors = follow(place)
        for successor in successors:
            if successor not in numbers:
                numbers[successor] = len(queue)
                queue.append(successor)
        nodes.append(Node(place.state, place.guarantee, tuple(numbers[s] for s in successors)))
    return Automaton(solution.game.specification.bits, tuple(nodes))


def _arrive(game: Game, place: Place, state: int) -> Place:
    i, j, colour = place.assumption, place.guarantee, 0
    if game.assumptions[i][place.state] >> state & 1:
        i = (i + 1) % len(game.assumptions)
        colour = 1 if i == 0 else 0
    if game.guarantees[j][place.state] >> state & 1:
        j = (j + 1) % len(game.guarantees)
        colour = 2 if j == 0 else colour
    return Place(state, i, j, colour)


def _add(
    arena: ParityGame, vertex: Vertex, owner: int, colour: int, successors: list[Vertex]
) -> None:
    arena.owner[vertex] = owner
    arena.colour[vertex] = colour
    arena.successors[vertex] = successors
    for successor in successors:
        arena.predecessors.setdefault(successor, []).append(vertex)


def _solve(arena: ParityGame) -> tuple[dict[Vertex, int], dict[Vertex, Vertex]]:
    """Who is stuck loses: take these regions out first, then Zielonka on a total graph."""
    remaining = set(arena.owner)
    winners: dict[Vertex, int] = {}
    choice: dict[Vertex, Vertex] = {}
    for loser in (SYSTEM, ENVIRONMENT):
        stuck = {v for v in remaining if arena.owner[v] == loser and not arena.successors[v]}
        lost, moves = _attract(arena, remaining, stuck, 1 - loser)
        remaining -= lost
        choice |= moves
        winners |= dict.fromkeys(lost, 1 - loser)
    for player, region in enumerate(_zielonka(arena, remaining, choice)):
        winners |= dict.fromkeys(region, player)
    return winners, choice


def _attract(
    arena: ParityGame, inside: set[Vertex], target: set[Vertex], player: int
) -> tuple[set[Vertex], dict[Vertex, Vertex]]:
    """The vertices from which `player` can force a visit to `target`, and how."""
    attracted = set(target)
    moves: dict[Vertex, Vertex] = {}
    escapes: dict[Vertex, int] = {}
    pending = list(target)
    while pending:
        vertex = pending.pop()
        for before in arena.predecessors.get(vertex, []):
            if before in attracted or before not in inside:
                continue
            if arena.owner[before] == player:
                moves[before] = vertex
            else:
                if before not in escapes:
                    escapes[before] = sum(s in inside for s in arena.successors[before])
                escapes[before] -= 1
                if escapes[before]:
                    continue
            attracted.add(before)
            pending.append(before)
    return attracted, moves


def _zielonka(
    arena: ParityGame, inside: set[Vertex], choice: dict[Vertex, Vertex]
) -> tuple[set[Vertex], set[Vertex]]:
    """The regions that system and environment win; `choice` gets the winners' moves."""
    if not inside:
        return set(), set()
    top = max(arena.colour[v] for v in inside)
    player = top % 2
    highest = {v for v in inside if arena.colour[v] == top}
    attracted, moves = _attract(arena, inside, highest, player)
    others = _zielonka(arena, inside - attracted, choice)[1 - player]
    if not others:
        choice |= moves
        for vertex in highest:
            if arena.owner[vertex] == player:
                choice[vertex] = next(s for s in arena.successors[vertex] if s in inside)
        return (inside, set()) if player == SYSTEM else (set(), inside)
    lost, escape = _attract(arena, inside, others, 1 - player)
    choice |= escape
    regions = _zielonka(arena, inside - lost, choice)
    if player == SYSTEM:
        return regions[SYSTEM], regions[ENVIRONMENT] | lost
    return regions[SYSTEM] | lost, regions[ENVIRONMENT]
