"""The explicit game of a specification, and the textbook fixpoint of GR(1), naively, with liveness
over transitions:

    nu Z. /\\_j mu Y. \\/_i nu X. cpre( (G_j & Z') | Y' | (!A_i & X') )

(Bloem, Jobstmann, Piterman, Pnueli and Sa'ar, Synthesis of Reactive(1) Designs, JCSS 2012.)
Nothing is shared between iterations and nothing is clever: this is what others are judged by.

A state is a number whose most significant bit is the first declared variable, so that numeric order
is the lexicographic order in which strategies list states. A set of states is an array of truths
[s]; a set of transitions has three axes, [s, c, o]: the state, and next inputs and outputs.
"""

import operator
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any

import numpy as np

from oracle.automata import Automaton, Node
from oracle.specification import (
    Atom,
    Compare,
    Constant,
    Formula,
    Number,
    Operation,
    Owner,
    Specification,
    prime,
)

Array = Any  # a numpy array


@dataclass(frozen=True)
class Game:
    """Two players. `successors[c, o]` is the state after inputs c and outputs o, ascending."""

    variables: tuple[str, ...]  # bits, as declared
    successors: Array
    env_init: Array
    sys_init: Array
    env: Array  # [s, c]
    sys: Array
    assumptions: tuple[Array, ...]
    guarantees: tuple[Array, ...]

    @cached_property
    def place(self) -> list[tuple[int, int]]:
        """The inputs and the outputs of each state."""
        order = np.argsort(self.successors, axis=None)
        rows, columns = np.unravel_index(order, self.successors.shape)
        return list(zip(rows.tolist(), columns.tolist(), strict=True))

    def has(self, transitions: Array, state: int, after: int) -> bool:
        return bool(transitions[(state, *self.place[after])])

    def inputs_of(self, states: Array) -> Array:
        """The inputs [c] with which there is one of these states."""
        return states[self.successors].any(-1)


_OPERATORS: dict[str, Callable[..., Array]] = {
    **{"&": operator.and_, "|": operator.or_, "^": operator.xor, "!": operator.invert},
    **{"->": lambda a, b: ~a | b, "<->": operator.eq, "=": operator.eq, "!=": operator.ne},
    **{"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge},
}


class _Truth:
    """Evaluates formulas of one specification on all transitions, each distinct object once: parsed
    ones share sub-formulas."""

    def __init__(self, specification: Specification) -> None:
        bits, self._variables = specification.bits, specification.variables
        states = np.arange(1 << len(bits))
        place = {bit: len(bits) - 1 - i for i, bit in enumerate(bits)}
        inputs = sum(1 << place[b] for v in self._variables for b in v.bits if v.owner == "input")
        order = np.lexsort((states, states & inputs))
        self.successors = order.reshape(len({*(states & inputs).tolist()}), -1)
        self._values, self._memo = dict[tuple[str, bool], Array](), dict[int, Any]()
        for v in self._variables:
            low, zero = v.range[0] if v.range else 0, np.zeros_like(states)
            each = low + sum(((states >> place[b] & 1) << i for i, b in enumerate(v.bits)), zero)
            each = each if v.range else each.astype(bool)
            self._values[v.name, False] = each[:, None, None]
            self._values[v.name, True] = each[self.successors][None]

    def all(self, formulas: Iterable[Formula]) -> Array:
        """The transitions on which all of them hold."""
        everywhere = np.ones((self.successors.size, *self.successors.shape), bool)
        return reduce(operator.and_, map(self._of, formulas), everywhere)

    def limits(self, owner: Owner, primed: bool) -> tuple[Formula, ...]:
        """That the integers of a player are inside their declared ranges."""
        return tuple(
            Compare("<=", (Number(v.name, primed),), (Number(v.range[1]),))
            for v in self._variables
            if v.owner == owner and v.range
        )

    def _of(self, formula: Formula) -> Array:
        if id(formula) not in self._memo:  # kept with the formula, whose id stays its own
            self._memo[id(formula)] = formula, self._evaluated(formula)
        return self._memo[id(formula)][1]

    def _evaluated(self, formula: Formula) -> Array:
        match formula:
            case Constant(value):
                return np.array([[[value]]])
            case Atom(name, primed):
                return self._values[name, primed]
            case Compare(relation, left, right):
                return _OPERATORS[relation](self._sum(left), self._sum(right))
            case Operation("next", (operand,)):
                return self._of(prime(operand))
            case Operation(operator, operands):
                return _OPERATORS[operator](*map(self._of, operands))

    def _sum(self, numbers: tuple[Number, ...]) -> Array:
        """Also of integers beyond their ranges."""
        zero = np.zeros((1, 1, 1), int)
        each = (self._values.get((n.value, n.primed), n.value) for n in numbers)
        return sum(each, zero)


def build_game(specification: Specification) -> Game:
    """Evaluate every section on every state and transition."""
    truth = _Truth(specification)
    # INIT formulas do not mention the successor, ENV_TRANS no next outputs: any of them suffices.
    env_init = truth.all((*specification.env_init, *truth.limits("input", False)))[:, 0, 0]
    sys_init = truth.all((*specification.sys_init, *truth.limits("output", False)))[:, 0, 0]
    env = truth.all((*specification.env_trans, *truth.limits("input", True)))[:, :, 0]
    sys = truth.all((*specification.sys_trans, *truth.limits("output", True)))
    fair, goals = (
        tuple(truth.all([formula]) for formula in formulas) or (truth.all([]),)
        for formulas in (specification.env_liveness, specification.sys_liveness)
    )
    return Game(specification.bits, truth.successors, env_init, sys_init, env, sys, fair, goals)


@dataclass(frozen=True)
class Moves:
    """SYS_TRANS & ( (G_j & Z') | (into `reached`) | (!A_i & into `waiting`) ); without A_i there is
    no waiting."""

    game: Game
    goal: Array
    winning: Array
    reached: Array
    assumption: Array | None = None
    waiting: Array | None = None

    def of(self, states: Any) -> Array:
        """Those from one state, or from all in a slice."""
        after = self.game.successors
        found = (self.goal[states] & self.winning[after]) | self.reached[after]
        if self.assumption is not None:
            found |= ~self.assumption[states] & self.waiting[after]
        return self.game.sys[states] & found

    @property
    def controllable(self) -> Array:
        """cpre: the states from which the system answers every allowed input by one of them."""
        return (~self.game.env | self.of(slice(None)).any(-1)).all(-1)


@dataclass(frozen=True)
class Solution:
    """The winning states and, per goal, the sets of moves in the order in which they arose."""

    game: Game
    winning: Array
    recorded: tuple[list[Moves], ...]

    def realizable(self, robotics_init: bool = False) -> bool:
        """Whether the system wins from the start, under either reading of the initial conditions.

        Standard: for every input valuation that ENV_INIT allows there is an output valuation with
        SYS_INIT in the winning set. Robotics: every position with ENV_INIT & SYS_INIT is winning.
        """
        game = self.game
        starts = game.env_init & game.sys_init
        if robotics_init:
            return not (starts & ~self.winning).any()
        answered = game.inputs_of(starts & self.winning)
        return not (game.inputs_of(game.env_init) & ~answered).any()


def realizable(specification: Specification) -> bool:
    return solve(build_game(specification)).realizable()


def solve(game: Game, bias_for_action: bool = False) -> Solution:
    """Solve by iterating from the top until nothing changes."""
    winning = np.ones_like(game.env_init)
    while True:
        found = [_least(game, goal, winning, bias_for_action) for goal in game.guarantees]
        agreed = reduce(operator.and_, (reached for reached, _ in found), winning)
        if np.array_equal(agreed, winning):
            return Solution(game, winning, tuple(recorded for _, recorded in found))
        winning = agreed


def _least(game: Game, goal: Array, winning: Array, bias: bool) -> tuple[Array, list[Moves]]:
    """mu Y, with what each round records: waiting builds on what the round began with."""
    recorded: list[Moves] = []
    reached = np.zeros_like(winning)
    while True:
        union = reached
        while bias:  # mu W. cpre( (G_j & Z') | Y' | W' ): progress that relies on no assumption
            recorded.append(Moves(game, goal, winning, union))
            larger = union | recorded[-1].controllable
            if np.array_equal(larger, union):
                break
            union = larger
        for assumption in game.assumptions:
            waiting, smaller = None, np.ones_like(winning)
            while not np.array_equal(smaller, waiting):
                waiting = smaller
                moves = Moves(game, goal, winning, reached, assumption, waiting)
                smaller = moves.controllable
            recorded.append(moves)
            union = union | waiting
        if np.array_equal(union, reached):
            return reached, recorded
        reached = union


def extract(solution: Solution) -> Automaton:
    """The explicit strategy of a realizable game that SLUGS prints, node for node.

    For (state, input, goal): the moves recorded first that answer the input there, and among their
    outputs the lexicographically smallest. Breadth first from all initial states.
    """
    game = solution.game
    numbers: dict[tuple[int, int], int] = {}
    queue: list[tuple[int, int]] = []

    def number(state: int, rank: int) -> int:
        if (state, rank) not in numbers:
            numbers[state, rank] = len(queue)
            queue.append((state, rank))
        return numbers[state, rank]

    for state in np.flatnonzero(game.env_init & game.sys_init & solution.winning).tolist():
        number(state, 0)
    nodes = []
    for state, goal in queue:  # grows while it is walked
        open_, chosen = game.env[state].copy(), list[int]()
        for moves in solution.recorded[goal]:
            if not open_.any():
                break
            possible = moves.of(state)
            answered = open_ & possible.any(-1)
            chosen += game.successors[answered, possible.argmax(-1)[answered]].tolist()
            open_ &= ~answered
        assert not open_.any(), f"state {state} is winning but has no move towards goal {goal}"
        after = [number(t, _advanced(game, goal, state, t)) for t in sorted(chosen)]
        nodes.append(Node(state, goal, after))
    return Automaton(game.variables, nodes)


def _advanced(game: Game, goal: int, state: int, after: int) -> int:
    """The next goal: past every goal in turn that this very transition satisfies."""
    count = len(game.guarantees)
    turns = ((goal + k) % count for k in range(count))
    return next((k for k in turns if not game.has(game.guarantees[k], state, after)), goal)
