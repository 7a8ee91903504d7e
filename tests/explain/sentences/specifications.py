"""Random specifications that are unrealizable for various reasons."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from random import Random

from oracle.generator import random_specification
from oracle.specification import Atom, Formula, Section, Specification, apply
from oracle.text import inputs_first


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
