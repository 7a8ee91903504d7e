"""The explicit game of a specification: states, moves and goals as sets of states.

Sets of states are Python integers, bit s for state s. A move of the environment from a state is the
set of states with which the system can answer (empty: the system is deadlocked).
"""

from dataclasses import dataclass
from functools import cached_property

from oracle.specification import Specification
from oracle.truth import TruthTables

StateSet = int


@dataclass(frozen=True)
class Game:
    """Two players on 2^bits states; `assumptions[i][s]` and `guarantees[j][s]` are sets of t."""

    specification: Specification
    bits: int
    env_init: StateSet
    sys_init: StateSet
    moves: tuple[dict[StateSet, StateSet], ...]  # per state: input class -> answers
    forbidden_inputs: tuple[StateSet, ...]  # per state: successors that break ENV_TRANS
    assumptions: tuple[tuple[StateSet, ...], ...]
    guarantees: tuple[tuple[StateSet, ...], ...]

    @cached_property
    def states(self) -> range:
        return range(1 << self.bits)

    @cached_property
    def all_states(self) -> StateSet:
        return (1 << (1 << self.bits)) - 1

    @cached_property
    def input_classes(self) -> tuple[StateSet, ...]:
        """One set of states for each valuation of the inputs, in lexicographic order."""
        return input_classes(self.specification)

    @cached_property
    def input_class_of(self) -> tuple[StateSet, ...]:
        """Per state: the states with the same inputs."""
        classes = [0] * (1 << self.bits)
        for inputs in self.input_classes:
            for state in members(inputs):
                classes[state] = inputs
        return tuple(classes)


def members(states: StateSet) -> list[int]:
    """The elements of a set in increasing (lexicographic) order."""
    result = []
    while states:
        lowest = states & -states
        result.append(lowest.bit_length() - 1)
        states ^= lowest
    return result


def input_classes(specification: Specification) -> tuple[StateSet, ...]:
    bits = specification.bits
    owned = [
        variable.owner == "input" for variable in specification.variables for _ in variable.bits
    ]
    mask = sum(1 << (len(bits) - 1 - i) for i, is_input in enumerate(owned) if is_input)
    classes: dict[int, StateSet] = {}
    for state in range(1 << len(bits)):
        classes[state & mask] = classes.get(state & mask, 0) | 1 << state
    return tuple(classes.values())


def build_game(specification: Specification) -> Game:
    """Evaluate every section on every state and transition."""
    tables = TruthTables(specification)
    bits = tables.bits
    inputs = tuple(v for v in specification.variables if v.owner == "input")
    outputs = tuple(v for v in specification.variables if v.owner == "output")

    def now(section: int) -> StateSet:
        # INIT formulas do not mention the successor: any column of the table will do.
        return sum(1 << s for s, row in enumerate(_rows(section, bits)) if row & 1)

    env_trans = tables.conjunction(specification.env_trans) & tables.limits(inputs, primed=True)
    sys_trans = tables.conjunction(specification.sys_trans) & tables.limits(outputs, primed=True)
    classes = input_classes(specification)
    moves = []
    forbidden = []
    full = (1 << (1 << bits)) - 1
    for env_row, sys_row in zip(_rows(env_trans, bits), _rows(sys_trans, bits), strict=True):
        # ENV_TRANS does not mention next outputs: it holds on all of a class or on none.
        moves.append({c: c & sys_row for c in classes if c & env_row})
        forbidden.append(full & ~env_row)
    return Game(
        specification,
        bits,
        now(tables.conjunction(specification.env_init) & tables.limits(inputs, primed=False)),
        now(tables.conjunction(specification.sys_init) & tables.limits(outputs, primed=False)),
        tuple(moves),
        tuple(forbidden),
        tuple(_rows(tables.table(f), bits) for f in specification.env_liveness)
        or (_rows(tables.full, bits),),
        tuple(_rows(tables.table(f), bits) for f in specification.sys_liveness)
        or (_rows(tables.full, bits),),
    )


def _rows(table: int, bits: int) -> tuple[StateSet, ...]:
    """Cut a table into one set of successors for each state."""
    size = 1 << bits
    if size < 8:
        return tuple(table >> (s * size) & ((1 << size) - 1) for s in range(size))
    data = table.to_bytes(size * size // 8, "little")
    step = size // 8
    return tuple(int.from_bytes(data[s * step : (s + 1) * step], "little") for s in range(size))
