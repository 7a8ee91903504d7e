"""Demands of an objective with formulas on one robot.

The formulas (docs/scenario.md, raw guarantees) are over ``region``, ``heading`` and the objective's
memory. A step is a pair of poses with the memory before and after; safety must hold on each step,
and every goal infinitely often.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache
from itertools import product
from math import prod
from typing import Any

from safenav.audit.language import (
    HEADINGS,
    Pose,
    RefusedError,
    Row,
    function_of,
    primed,
    read_clause,
    require,
)
from safenav.audit.lines import Objective

MOST_VALUATIONS = 64
_VARIABLE = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,99}")
_LARGEST = 2**31 - 1

Poses = frozenset[Pose]
State = tuple[Pose, int]


class Texts:
    """The formulas of an objective, parsed: the values of its ``memory`` and of the ``inputs`` that
    they name, and the clauses of each part. ``always``: formulas on each step that it takes. Raises
    RefusedError for formulas that cannot be read."""

    def __init__(self, body: Mapping[str, object], always: Iterable[str] = ()) -> None:
        require(isinstance(body, Mapping), "formulas that are not an object")
        memory: Any = body.get("memory") or {}
        require(isinstance(memory, Mapping), "the memory is not one of names")
        self.memory = {
            k: range(2) if kind == "bool" else _range(kind) for k, kind in memory.items()
        }
        self.inputs = dict.fromkeys(_lines(body, "inputs"), range(2))  # of any value
        wrong = [repr(k)[:20] for k in (*memory, *self.inputs) if not _VARIABLE.fullmatch(k)]
        require(not wrong, f"{', '.join(wrong[:3])} cannot name a variable")
        truths = frozenset([*self.inputs, *(k for k, kind in memory.items() if kind == "bool")])
        parts = (_lines(body, part) for part in ("init", "safety", "liveness"))
        read = ([read_clause(line, truths) for line in lines] for lines in parts)
        self.init, self.safety, self.liveness = read
        self.safety += [read_clause(f"region' = region | ({text})", truths) for text in always]


class Formulas:
    """The guarantees of one robot. ``valuations``: the possible values of its memory, with the
    inputs that its formulas name. ``few``: raise RefusedError if these are too many; otherwise
    formulas that read them are then skipped."""

    def __init__(self, texts: Texts, *, few: bool = True) -> None:
        kinds, about = texts.memory | texts.inputs, ["region", "heading"]
        parts = [texts.init, texts.safety, texts.liveness]
        if (many := prod(map(len, kinds.values()))) > MOST_VALUATIONS:
            require(not few, f"{many} valuations of the memory")
            known, kinds = {*about, *primed(about)}, {}
            parts = [[clause for clause in part if clause.reads <= known] for part in parts]
        self.valuations: list[Row] = [*product(*kinds.values())]
        self.names = [*kinds]
        keys = (*about, *kinds)
        unknown = {name.rstrip("'") for part in parts for clause in part for name in clause.reads}
        require(unknown <= {*keys}, f"unknown names: {', '.join(sorted(unknown - {*keys}))}")
        both = (*keys, *primed(keys))
        self._init, self._safe = (function_of(both, (*part,)) for part in parts[:2])
        self.goals = [function_of(both, (clause,)) for clause in parts[2]]

    def begins(self, pose: Pose) -> list[Row]:
        """Return the initial values of the memory that the objective allows in a pose."""
        states = ((*_row(pose), *values) for values in self.valuations)
        return [state[2:] for state in states if self._init(*state, *state)]

    def allows(self, before: Pose, after: Pose) -> bool:
        """Return whether the guarantees allow the step for some value of the memory."""
        return any(self._safe(*values) for _, _, values in self._values(before, after))

    def meets(self, goal: int, before: Pose, after: Pose) -> bool:
        """Return whether the step may meet a goal, with some memory."""
        return any(self.goals[goal](*values) for _, _, values in self._values(before, after))

    def steps(self, before: Pose, after: Pose) -> Iterator[tuple[int, int, frozenset[int]]]:
        """Yield the allowed steps between two poses: the memory (by number) before and after, and
        the goals that the step meets."""
        for i, j, values in self._values(before, after):
            if self._safe(*values):
                yield i, j, frozenset(k for k, goal in enumerate(self.goals) if goal(*values))

    def met_by_staying(self, pose: Pose, memory: int) -> frozenset[int]:
        """Return the goals that a robot meets by staying in a pose with that memory."""
        row = *_row(pose), *self.valuations[memory]
        return frozenset(k for k, goal in enumerate(self.goals) if goal(*row, *row))

    def live(self, inside: Poses, steps: Mapping[Pose, Iterable[Pose]]) -> set[State]:
        """Return the greatest set of poses, each with the number of a valuation, from which a
        robot can meet every goal infinitely often by steps, or by staying, within it."""
        edges = [
            ((a, i), (b, j), goals)
            for a in inside
            for b in (a, *steps.get(a, ()))
            if b in inside
            for i, j, goals in self.steps(a, b)
        ]
        kept, before = {state for edge in edges for state in edge[:2]}, set[State]()
        while kept != before:
            before = kept
            for goal in range(max(len(self.goals), 1)):
                within = [edge for edge in edges if edge[0] in kept and edge[1] in kept]
                found = {a for a, _, goals in within if goal in goals or not self.goals}
                more = found
                while more:
                    more = {a for a, b, _ in within if b in more} - found
                    found = found | more
                kept = found
        return kept

    def _values(self, before: Pose, after: Pose) -> Iterator[tuple[int, int, Row]]:
        (one, other), memory = (_row(before), _row(after)), enumerate(self.valuations)
        for (i, old), (j, new) in product(memory, enumerate(self.valuations)):
            yield i, j, (*one, *old, *other, *new)


@lru_cache(maxsize=64)
def rules_of(objective: Objective, *, few: bool = True) -> Formulas:
    """Return the demands of an objective on each step: its own formulas and its ``always``.
    ``few``: as in Formulas. Raises RefusedError."""
    own = json.loads(objective.body) if objective.kind == "ltl" else {}
    return Formulas(Texts(own, objective.always), few=few)


def _row(pose: Pose) -> Row:
    region, heading = pose
    return region, -1 if heading is None else HEADINGS.index(heading)


def _range(kind: object) -> range:
    if isinstance(kind, list) and len(kind) == 2 and all(type(one) is int for one in kind):
        least, most = kind
        require(-_LARGEST <= least <= most <= _LARGEST, "the range of a memory variable")
        return range(least, most + 1)
    raise RefusedError(f"the memory {str(kind)[:20]!r}")


def _lines(body: Mapping[str, object], key: str) -> list[str]:
    value = body.get(key) or []
    lines = [value] if isinstance(value, str) else value
    if not isinstance(lines, list) or not all(isinstance(line, str) for line in lines):
        raise RefusedError(f"{key} is not a list of formulas")
    return [str(line) for line in lines]
