"""Random specifications, and scenarios of one robot on a tiny map, most unrealizable; claims about
them are judged by brute force on their explicit games."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from random import Random
from typing import Any

import numpy as np

from oracle.game import Array, build_game, realizable, solve
from oracle.generator import random_specification
from oracle.specification import SECTIONS, Atom, Formula, Section, Specification, Variable, apply
from oracle.text import inputs_first, read_infix
from safenav import Heading, InputError, Pose, RegionMap, Robot, Scenario, load_scenario_text
from safenav import Specification as Compiled


def drawn(source: Random) -> Specification:
    """A specification, perhaps with one or two planted conflicts."""
    integers = source.random() < 0.4
    spec = inputs_first(random_specification(source, integers, bits=source.choice((3, 4, 5))))
    for _ in range(source.choice((0, 1, 1, 2))):
        names = {
            owner: [v.name for v in spec.variables if v.owner == owner and v.range is None]
            for owner in ("input", "output")
        }
        if names["output"]:
            section, formulas = source.choice(_CONFLICTS)(source, names["input"], names["output"])
            spec = replace(spec, **{section: (*spec.section(section), *formulas)})
    return spec


Conflict = tuple[Section, list[Formula]]


def _literal(source: Random, name: str, primed: bool) -> Formula:
    atom = Atom(name, primed)
    return atom if source.random() < 0.5 else apply("!", atom)


def _start(source: Random, inputs: list[str], outputs: list[str]) -> Conflict:
    """Some initial inputs, or none, leave an output."""
    out = Atom(source.choice(outputs))
    if not inputs:
        return "sys_init", [out, apply("!", out)]
    first, second = (_literal(source, source.choice(inputs), False) for _ in range(2))
    return "sys_init", [apply("->", first, out), apply("->", second, apply("!", out))]


def _contradiction(source: Random, _: list[str], outputs: list[str]) -> Conflict:
    out = Atom(source.choice(outputs), True)
    return "sys_trans", [out, apply("!", out)]


def _dead_end(source: Random, inputs: list[str], outputs: list[str]) -> Conflict:
    """A promise about the next input."""
    if not inputs:
        return _contradiction(source, inputs, outputs)
    guard = _literal(source, source.choice(outputs), source.random() < 0.5)
    return "sys_trans", [apply("->", guard, _literal(source, source.choice(inputs), True))]


def _withheld(source: Random, inputs: list[str], outputs: list[str]) -> Conflict:
    """A goal that needs an input."""
    out = _literal(source, source.choice(outputs), False)
    need = _literal(source, source.choice(inputs or outputs), False)
    return "sys_liveness", [apply("&", out, need)]


def _alternating(source: Random, _: list[str], outputs: list[str]) -> Conflict:
    """Outputs that never change."""
    name = source.choice(outputs)
    return "sys_trans", [apply("<->", Atom(name, True), Atom(name)), _literal(source, name, True)]


_CONFLICTS: list[Callable[[Random, list[str], list[str]], Conflict]] = [
    _start,
    _contradiction,
    _dead_end,
    _withheld,
    _withheld,
    _alternating,
]


def drawn_scenario(source: Random) -> Scenario:
    """A scenario that the loader accepts; it is printed."""
    while True:
        text = json.dumps(_mission(source))
        try:
            scenario = load_scenario_text(text, "s.yaml", reachable=False)
        except InputError:
            continue
        print(text)
        return scenario


def _mission(source: Random) -> dict[str, Any]:
    rows, cols = source.choice(((1, 5), (2, 3), (2, 4), (3, 3), (2, 2)))
    cells = rows * cols
    walls = {r for r in range(cells) if source.random() < 0.25}
    free = [r for r in range(cells) if r not in walls]
    if len(free) < 3:
        return _mission(source)
    grid = [
        "".join("#" if r * cols + c in walls else "." for c in range(cols)) for r in range(rows)
    ]
    digit = source.random() < 0.3
    start, *others = source.sample(free, 3)
    robot: dict[str, Any] = {"model": "digit" if digit else "go2", "start": start}
    if digit:
        robot["heading"] = source.choice(("north", "east", "south", "west"))
    data: dict[str, Any] = {"safenav": 1, "map": {"grid": grid}, "robots": {"r": robot}}
    if digit or source.random() < 0.3:
        robot["objective"] = _targets(source, others, free)
    else:
        inputs = source.sample(("fire", "person"), source.choice((0, 1, 1, 2)))
        robot["objective"] = {"ltl": _formulas(source, inputs, free)}
        fair = source.choice(({}, {}, {"always_eventually": source.choice(("on", "off"))}))
        if inputs:
            data["inputs"] = {name: {"at": 2, **fair} for name in inputs}
    return data


def _targets(source: Random, others: list[int], free: list[int]) -> dict[str, Any]:
    kind = source.choice(("patrol", "visit", "once", "cover", "hold"))
    targets = [
        {"any": source.sample(free, 2)} if source.random() < 0.25 else each for each in others
    ]
    if kind == "visit":
        targets = [*targets, source.choice(free)][: source.randint(1, 3)]
    objective: dict[str, Any] = {kind: targets[0] if kind == "hold" else targets}
    if kind == "patrol" and source.random() < 0.4:
        objective["form"] = "literal"
    if source.random() < 0.3:
        objective["always"] = [f"region != {source.choice(free)}"]
    return objective


def _formulas(source: Random, inputs: list[str], free: list[int]) -> dict[str, Any]:
    def at() -> str:
        return f"region {source.choice(('=', '!='))} {source.choice(free)}"

    def event() -> str:
        name = source.choice([*inputs, "load"])
        return f"{source.choice(('', '!'))}{name}{source.choice(('', chr(39)))}"

    found: dict[str, Any] = {"memory": {"load": "bool"}, "init": source.choice(("!load", "load"))}
    if inputs and source.random() < 0.2:
        found["init"] = f"{source.choice(('', '!'))}{inputs[0]} -> {at()}"
    rules = [f"{event()} -> region' != {source.choice(free)}" for _ in range(source.randint(0, 3))]
    rules += [f"{event()} -> region' = region"] if source.random() < 0.3 else []
    rules += [f"load' <-> {event()} | {at()}"] if source.random() < 0.6 else []
    goals = [source.choice((at(), event(), f"{event()} & {at()}")) for _ in range(2)]
    return {**found, "safety": rules, "liveness": goals}


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


def realizable_together(spec: Specification) -> bool:
    """Whether one player who controls everything can satisfy all lines."""
    owned = tuple(replace(v, owner="output") for v in spec.variables)
    moved = [(section.replace("env", "sys"), formula) for section, formula in lines_of(spec)]
    return realizable(with_lines(replace(spec, variables=owned), moved))  # type: ignore[arg-type]


@dataclass
class Judge:
    """One specification, and the members of a core, each as lines of it."""

    spec: Specification
    members: Sequence[Sequence[Line]]

    def __post_init__(self) -> None:
        self.core = [*chain(*self.members)]
        self.assumed = [line for line in lines_of(self.spec) if line[0] not in GUARANTEES]
        self.promised = [line for line in lines_of(self.spec) if line[0] in GUARANTEES]
        self.part = self.with_guarantees(self.core)
        self.solution = solve(build_game(self.part))
        bits = {bit: place for place, bit in enumerate(reversed(self.spec.bits))}
        self.states = [
            {
                v.name: (v.range or (0,))[0]
                + sum((state >> bits[bit] & 1) << k for k, bit in enumerate(v.bits))
                for v in self.spec.variables
            }
            for state in range(1 << len(bits))
        ]

    def with_guarantees(self, lines: Iterable[Line]) -> Specification:
        return with_lines(self.spec, [*self.assumed, *lines])

    def fails(self) -> bool:
        return not self.solution.realizable()

    def minimal(self) -> bool:
        every = self.members
        parts = (chain(*every[:k], *every[k + 1 :]) for k in range(len(every)))
        return all(realizable(self.with_guarantees(some)) for some in parts)

    def suffices_to_omit(self, place: int) -> bool:
        """Whether the whole is realizable without one member of the core."""
        left = list(self.promised)
        left.remove(self.core[place])
        return realizable(self.with_guarantees(left))

    def having(self, values: Values) -> Array:
        """All states with these values of some variables."""
        wanted = values.items()
        return np.array([all(state[name] == x for name, x in wanted) for state in self.states])

    def check_play(
        self,
        ending: str,
        moments: Sequence[Values],
        cycle: Sequence[Values],
        inputs: Values,
        goal: Formula | None,
    ) -> None:
        """Check that a play obeys assumptions and core, and is lost."""
        game, winning = self.solution.game, self.solution.winning
        walk = [int(self.having(values).argmax()) for values in (*moments, *cycle)]
        if ending == "no_beginning":
            allowed = self.having(inputs) & game.env_init
            assert not walk and allowed.any() and not (allowed & game.sys_init).any()
            return
        assert game.env_init[walk[0]] and game.sys_init[walk[0]], "no initial state"
        loop = [walk[len(moments)]] if cycle else []
        for a, b in zip(walk, [*walk[1:], *loop], strict=False):
            assert game.env[a, game.place[b][0]] and game.has(game.sys, a, b), (a, b)
        assert not winning[walk].any(), "a state is not lost"
        if ending == "stuck":
            assert not cycle
            wanted = game.inputs_of(self.having(inputs))
            left = np.flatnonzero(game.env[walk[-1]] & wanted)
            assert left.size and not game.sys[walk[-1], left[0]].any()
            assert not inputs or left.size == 1
            return
        turns = walk[len(moments) :]
        steps = list(zip(turns, [*turns[1:], turns[0]], strict=True))
        for fair in game.assumptions:
            assert any(game.has(fair, *step) for step in steps), "an assumption is not met"
        assert goal in self.part.sys_liveness
        met = game.guarantees[self.part.sys_liveness.index(goal)]
        assert not any(game.has(met, *step) for step in steps), "the goal is met"


def as_oracle(spec: Compiled) -> Specification:
    """A compiled specification as the oracle has it."""
    variables = tuple(Variable(v.name, v.owner.lower(), v.bounds) for v in spec.variables)
    lines = [*map(line_of, spec.constraints)]
    return with_lines(Specification(variables), lines)


def line_of(constraint: Any) -> Line:
    section: Any = constraint.section.lower()
    return section, read_infix(constraint.formula)


def moves(robot: Robot, pose: Pose, world: RegionMap) -> list[Pose]:
    """The poses after one tick: it stays, or steps; one with a heading never backwards."""
    found, turns = [pose], robot.model.mobility == "heading"
    for way in Heading:
        target = world.step(pose.region, way)
        backwards = turns and pose.heading is not None and (way - pose.heading) % 4 == 2
        if target in world.free and not backwards:
            found.append(Pose(target, way if turns else None))
    return found
