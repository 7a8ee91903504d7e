"""Random specifications, and scenarios of one robot on a tiny map, most of them unrealizable."""

import json
from collections.abc import Callable
from dataclasses import replace
from random import Random
from typing import Any

from oracle.generator import random_specification
from oracle.specification import Atom, Formula, Section, Specification, apply
from oracle.text import inputs_first
from safenav.errors import InputError
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text


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
