"""Check of what is claimed about specifications, by brute force on their explicit games."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from oracle.fixpoint import is_realizable, solve
from oracle.formula import FALSE, Formula
from oracle.game import Game, StateSet, build_game
from oracle.specification import SECTIONS, Section, Specification

Line = tuple[Section, Formula]
Values = Mapping[str, int]
GUARANTEES: tuple[Section, ...] = ("sys_init", "sys_trans", "sys_liveness")


def lines_of(spec: Specification) -> list[Line]:
    return [(section, formula) for section in SECTIONS for formula in spec.section(section)]


def with_lines(spec: Specification, lines: Iterable[Line]) -> Specification:
    """The variables of a specification with these lines."""
    kept = list(lines)
    sections = {name: tuple(f for s, f in kept if s == name) for name in SECTIONS}
    return replace(spec, **sections)


def realizable(spec: Specification) -> bool:
    game = build_game(spec)
    return is_realizable(game, solve(game).winning)


def realizable_together(spec: Specification) -> bool:
    """Whether one player who controls everything can satisfy all lines."""
    owned = tuple(replace(v, owner="output") for v in spec.variables)
    moved = [(section.replace("env", "sys"), formula) for section, formula in lines_of(spec)]
    return realizable(with_lines(replace(spec, variables=owned), moved))  # type: ignore[arg-type]


def never(spec: Specification) -> Specification:
    """The same with a goal that is false: realizable iff the assumptions can be broken."""
    return replace(spec, sys_liveness=(FALSE,))


@dataclass
class Judge:
    """One specification and the set of its lines that are a core."""

    spec: Specification
    core: Sequence[Line]

    def __post_init__(self) -> None:
        self.assumed = [line for line in lines_of(self.spec) if line[0] not in GUARANTEES]
        self.promised = [line for line in lines_of(self.spec) if line[0] in GUARANTEES]
        self.part = self.with_guarantees(self.core)
        self.game: Game = build_game(self.part)
        self.winning: StateSet = solve(self.game).winning

    def with_guarantees(self, lines: Iterable[Line]) -> Specification:
        return with_lines(self.spec, [*self.assumed, *lines])

    def fails(self) -> bool:
        return not is_realizable(self.game, self.winning)

    def minimal(self) -> bool:
        parts = ([*self.core[:k], *self.core[k + 1 :]] for k in range(len(self.core)))
        return all(realizable(self.with_guarantees(some)) for some in parts)

    def suffices_to_omit(self, place: int) -> bool:
        """Whether the whole is realizable without one member of the core."""
        left = list(self.promised)
        left.remove(self.core[place])
        return realizable(self.with_guarantees(left))

    def state(self, values: Values) -> int:
        number, bits = 0, len(self.spec.bits)
        position = {bit: bits - 1 - i for i, bit in enumerate(self.spec.bits)}
        for variable in self.spec.variables:
            low = 0 if variable.range is None else variable.range[0]
            for i, bit in enumerate(variable.bits):
                number |= (values[variable.name] - low >> i & 1) << position[bit]
        return number

    def inputs(self, values: Values) -> StateSet:
        """All states with these values of inputs."""
        named = [v for v in self.spec.variables if v.name in values]
        return sum(
            1 << s
            for s in self.game.states
            if all(self._value(s, v.name) == values[v.name] for v in named)
        )

    def _value(self, state: int, name: str) -> int:
        bits = len(self.spec.bits)
        position = {bit: bits - 1 - i for i, bit in enumerate(self.spec.bits)}
        variable = next(v for v in self.spec.variables if v.name == name)
        low = 0 if variable.range is None else variable.range[0]
        return low + sum((state >> position[b] & 1) << i for i, b in enumerate(variable.bits))

    def check_play(
        self,
        ending: str,
        moments: Sequence[Values],
        cycle: Sequence[Values],
        inputs: Values,
        goal: Formula | None,
    ) -> None:
        """Check that a play obeys assumptions and core, and is lost."""
        game, walk = self.game, [self.state(values) for values in (*moments, *cycle)]
        if ending == "no_beginning":
            allowed = self.inputs(inputs) & game.env_init
            assert not walk and allowed and not allowed & game.sys_init
            return
        assert game.env_init & game.sys_init & 1 << walk[0], "no initial state"
        loop = [walk[len(moments)]] if cycle else []
        for a, b in zip(walk, [*walk[1:], *loop], strict=False):
            assert any(answers & 1 << b for answers in game.moves[a].values()), (a, b)
        assert not any(self.winning & 1 << s for s in walk), "a state is not lost"
        if ending == "stuck":
            assert not cycle
            wanted = self.inputs(inputs)
            left = [answers for c, answers in game.moves[walk[-1]].items() if c & wanted]
            assert left and not left[0]
            assert not inputs or len(left) == 1
            return
        turns = walk[len(moments) :]
        steps = list(zip(turns, [*turns[1:], turns[0]], strict=True))
        for fair in game.assumptions:
            assert any(fair[a] & 1 << b for a, b in steps), "an assumption is not met"
        assert goal in self.part.sys_liveness
        met = game.guarantees[self.part.sys_liveness.index(goal)]
        assert not any(met[a] & 1 << b for a, b in steps), "the goal is met"
