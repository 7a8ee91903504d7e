"""Vacuity: wins of a system that come from breaking its own assumptions.

A strategy may force the environment into a state with no move left, or one where it cannot meet a
fairness assumption. From there on no guarantee binds the system: it has won, and may do nothing at
all. Such a win is worth a warning. (Klein, Pnueli: Revisiting synthesis of GR(1) specifications,
HVC 2010, and Maoz, Ringert: On well-separation of GR(1) specifications, FSE 2016, who examine the
specification; here the strategy in use is examined.) The specifications of robots cannot be won so:
whatever the robot does, their assumptions can be satisfied."""

from __future__ import annotations

from enum import StrEnum

from msgspec import Struct

from safenav.components import explored
from safenav.spec.specification import Origin, Section, Specification
from safenav.synthesis.strategy import Strategy
from safenav.verify.automaton import Automaton
from safenav.verify.cycles import cyclic_parts


class Cause(StrEnum):
    """Causes for which a system wins vacuously; the value states it in words."""

    NO_BEGINNING = "no initial state satisfies the assumptions, so nothing is guaranteed"
    DEAD_END = "a state can occur in which the assumptions allow no move"
    UNFAIR = "a state can occur from which these assumptions cannot all be met"


class Vacuity(Struct, frozen=True):
    """A way in which a system could win without doing anything.

    ``path``: nodes of its strategy, the shortest path to where it happens. ``origins``: the
    assumptions that fail."""

    cause: Cause
    path: tuple[int, ...] = ()
    origins: tuple[Origin, ...] = ()


def vacuities(strategy: Strategy) -> tuple[Vacuity, ...]:
    """Return how a strategy wins without keeping its goals, if it does: shortest paths first.

    The robot's moves are fixed by the strategy, so the others play alone on its automaton: a node
    from which no path of theirs meets all assumptions infinitely often is won vacuously."""
    spec = strategy.specification
    starts = strategy.initial()
    if not starts:
        return (Vacuity(Cause.NO_BEGINNING, origins=_origins(spec, Section.ENV_INIT)),)
    automaton = Automaton(spec, strategy, starts)
    found = []
    stuck = [node for node in automaton.nodes if not strategy.transitions[node]]
    if stuck:
        steps = _origins(spec, Section.ENV_TRANS)
        found.append(Vacuity(Cause.DEAD_END, automaton.path(stuck[0]), steps))
    parts = cyclic_parts(automaton.edges)
    fair = automaton.clauses(Section.ENV_LIVENESS)
    lacking = _lacking(automaton, parts, len(fair))
    good = {node for node, part in parts.items() if not lacking[part]}
    hopeless = _cut_off(automaton, good | set(stuck))
    if hopeless:
        first = next(node for node in automaton.nodes if node in hopeless)
        within = explored([first], strategy.transitions.__getitem__)
        ahead = [lacking[part] for node, part in parts.items() if node in within]
        never = [k for k in range(len(fair)) if all(k in missing for missing in ahead)]
        failing = dict.fromkeys(fair[k].constraint.origin for k in never or range(len(fair)))
        path = automaton.path(first)
        found.append(Vacuity(Cause.UNFAIR, path, tuple(failing)))
    return tuple(sorted(found, key=lambda vacuity: len(vacuity.path)))


def _origins(spec: Specification, *sections: Section) -> tuple[Origin, ...]:
    found = (c.origin for section in sections for c in spec.section(section))
    return tuple(dict.fromkeys(found))


def _lacking(automaton: Automaton, parts: dict[int, int], count: int) -> dict[int, set[int]]:
    """Return for each strongly connected part the assumptions that no transition within it
    meets."""
    lacking = {part: set(range(count)) for part in set(parts.values())}
    formulas = [clause.formula for clause in automaton.clauses(Section.ENV_LIVENESS)]
    for k, unmet in enumerate(automaton.violated(formulas)):
        missing = automaton.edges.flags(unmet)
        for index, (source, target) in enumerate(automaton.edges):
            part = parts.get(source)
            if not missing[index] and part is not None and part == parts.get(target):
                lacking[part].discard(k)
    return lacking


def _cut_off(automaton: Automaton, good: set[int]) -> set[int]:
    """Return the nodes from which none of the good ones can be reached."""
    before: dict[int, list[int]] = {}
    for source, target in automaton.edges:
        before.setdefault(target, []).append(source)
    return set(automaton.nodes) - explored(good, lambda node: before.get(node, ())).keys()
