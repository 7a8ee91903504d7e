"""The textbook fixpoint of GR(1), naively, with liveness over transitions.

    nu Z. /\\_j mu Y. \\/_i nu X. cpre( (G_j & Z') | Y' | (!A_i & X') )

(Bloem, Jobstmann, Piterman, Pnueli and Sa'ar, Synthesis of Reactive(1) Designs, JCSS 2012.)
Nothing is shared between iterations and nothing is clever: this is what others are judged by.
"""

from dataclasses import dataclass

from oracle.automaton import Automaton, Node
from oracle.game import Game, StateSet, members


@dataclass(frozen=True)
class TransitionSet:
    """The transitions (G_j & Z') | (into `reached`) | (!A_i into `waiting`); no A_i: no waiting."""

    reached: StateSet
    assumption: int | None
    waiting: StateSet


@dataclass(frozen=True)
class Solution:
    """The winning states and, per goal, the transition sets in the order in which they arose."""

    game: Game
    winning: StateSet
    recorded: tuple[tuple[TransitionSet, ...], ...]

    def allowed(self, goal: int, transitions: TransitionSet, state: int) -> StateSet:
        """The successors of a state along these transitions, SYS_TRANS aside."""
        return _targets(self.game, goal, self.winning, transitions, state)


def solve(game: Game, bias_for_action: bool = False) -> Solution:
    """Solve by iterating from the top until nothing changes."""
    winning = game.all_states
    while True:
        recorded = []
        agreed = winning
        for goal in range(len(game.guarantees)):
            reached, sets = _least(game, goal, winning, bias_for_action)
            agreed &= reached
            recorded.append(tuple(sets))
        if agreed == winning:
            return Solution(game, winning, tuple(recorded))
        winning = agreed


def _least(
    game: Game, goal: int, winning: StateSet, bias_for_action: bool
) -> tuple[StateSet, list[TransitionSet]]:
    """mu Y, with what each round records: waiting builds on what the round began with."""
    sets: list[TransitionSet] = []
    reached = 0
    while True:
        union = reached
        if bias_for_action:
            union = _plain_steps(game, goal, winning, reached, sets)
        for i in range(len(game.assumptions)):
            waiting = game.all_states
            while True:
                transitions = TransitionSet(reached, i, waiting)
                smaller = controllable(game, goal, winning, transitions)
                if smaller == waiting:
                    break
                waiting = smaller
            sets.append(transitions)
            union |= waiting
        if union == reached:
            return reached, sets
        reached = union


def _plain_steps(
    game: Game, goal: int, winning: StateSet, reached: StateSet, sets: list[TransitionSet]
) -> StateSet:
    """mu W. cpre( (G_j & Z') | Y' | W' ): progress that relies on no assumption."""
    while True:
        transitions = TransitionSet(reached, None, 0)
        larger = reached | controllable(game, goal, winning, transitions)
        sets.append(transitions)
        if larger == reached:
            return reached
        reached = larger


def controllable(game: Game, goal: int, winning: StateSet, transitions: TransitionSet) -> StateSet:
    """cpre: the states from which the system answers every allowed input along `transitions`."""
    result = 0
    for state in game.states:
        targets = _targets(game, goal, winning, transitions, state)
        if all(answers & targets for answers in game.moves[state].values()):
            result |= 1 << state
    return result


def _targets(
    game: Game, goal: int, winning: StateSet, transitions: TransitionSet, state: int
) -> StateSet:
    targets = (game.guarantees[goal][state] & winning) | transitions.reached
    if transitions.assumption is not None:
        targets |= ~game.assumptions[transitions.assumption][state] & transitions.waiting
    return targets


def initial_states(game: Game) -> StateSet:
    """All legal starts: ENV_INIT & SYS_INIT."""
    return game.env_init & game.sys_init


def is_realizable(game: Game, winning: StateSet, robotics_init: bool = False) -> bool:
    """Whether the system wins from the start, under either reading of the initial conditions.

    Standard: for every input valuation that ENV_INIT allows there is an output valuation with
    SYS_INIT in the winning set.  Robotics: every position with ENV_INIT & SYS_INIT is winning.
    """
    starts = initial_states(game)
    if robotics_init:
        return starts & ~winning == 0
    return not losing_inputs(game, winning)


def losing_inputs(game: Game, winning: StateSet) -> list[StateSet]:
    """The input classes that ENV_INIT allows and that no initial output answers."""
    return [
        inputs
        for inputs in game.input_classes
        if inputs & game.env_init and not inputs & game.env_init & game.sys_init & winning
    ]


def extract(solution: Solution) -> Automaton:
    """The explicit strategy of a realizable game that SLUGS prints, node for node.

    For (state, input, goal): the transition set recorded first that covers the state and input, and
    among its outputs the lexicographically smallest. Breadth first from all initial states.
    """
    game = solution.game
    numbers: dict[tuple[int, int], int] = {}
    queue: list[tuple[int, int]] = []

    def number(state: int, rank: int) -> int:
        if (state, rank) not in numbers:
            numbers[state, rank] = len(queue)
            queue.append((state, rank))
        return numbers[state, rank]

    for state in members(initial_states(game) & solution.winning):
        number(state, 0)
    nodes = []
    for state, goal in queue:  # grows while it is walked
        chosen = sorted(
            _choose(solution, goal, state, answers) for answers in game.moves[state].values()
        )
        successors = tuple(number(t, advance(solution, goal, state, t)) for t in chosen)
        nodes.append(Node(state, goal, successors))
    return Automaton(game.specification.bits, tuple(nodes))


def advance(solution: Solution, goal: int, state: int, successor: int) -> int:
    """The next goal: past every goal in turn that this very transition satisfies."""
    guarantees = solution.game.guarantees
    for _ in range(len(guarantees)):
        if not guarantees[goal][state] >> successor & 1:
            break
        goal = (goal + 1) % len(guarantees)
    return goal


def _choose(solution: Solution, goal: int, state: int, answers: StateSet) -> int:
    for transitions in solution.recorded[goal]:
        covered = answers & solution.allowed(goal, transitions, state)
        if covered:
            return (covered & -covered).bit_length() - 1
    raise AssertionError(f"state {state} is called winning but has no move towards goal {goal}")
