"""Demands of an objective in formulas on one robot, by an independent reader.

The language is that of docs/scenario.md (raw guarantees), over ``region``, ``heading`` and the
objective's memory. A step is a pair of poses with the memory before and after; safety must hold on
each, and every goal infinitely often."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product

from safenav.trace.objective import Objective

Pose = tuple[int, str | None]
Values = Mapping[str, int]
Formula = Callable[[Values, Values], int]
"""The value of a formula for the values before and after a step."""

MOST_VALUATIONS = 64

_HEADINGS = {"north": 0, "east": 1, "south": 2, "west": 3}
_TOKEN = re.compile(
    r"\s*(<-->|<->|-->|->|&&|/\\|\|\||\\/|!=|<=|>=|[A-Za-z_]\w*'?|\d+|[+()!~&|^=<>'])"
)
_SAME = {"&&": "&", "/\\": "&", "||": "|", "\\/": "|", "~": "!", "-->": "->", "<-->": "<->"}


class UnreadError(Exception):
    """A formula that this reading does not understand."""


@dataclass(frozen=True)
class Formulas:
    """The guarantees of one robot. ``memory``: the values that each variable can have."""

    safety: tuple[Formula, ...]
    liveness: tuple[Formula, ...]
    memory: Mapping[str, range]

    @cached_property
    def valuations(self) -> tuple[Values, ...]:
        names = list(self.memory)
        return tuple(
            dict(zip(names, values, strict=True))
            for values in product(*(self.memory[name] for name in names))
        )

    def allows(self, before: Pose, after: Pose) -> bool:
        """Return whether the step is allowed with some memory."""
        return any(True for _ in self.steps(before, after))

    def meets(self, goal: int, before: Pose, after: Pose) -> bool:
        """Return whether the step may meet a goal, with some memory."""
        line, old, new = self.liveness[goal], _values(before), _values(after)
        pairs = product(self.valuations, repeat=2)
        return any(line({**old, **one}, {**new, **other}) for one, other in pairs)

    def goal_regions(self, poses: Iterable[Pose]) -> tuple[frozenset[int], ...]:
        """Return for each goal the regions in which a robot that stays may meet it; all regions for
        a goal that only a move can meet."""
        places = list(poses)
        everywhere = frozenset(region for region, _ in places)

        def meets(goal: Formula, pose: Pose) -> bool:
            return any(
                goal({**_values(pose), **old}, {**_values(pose), **new})
                for old in self.valuations
                for new in self.valuations
            )

        found = [
            frozenset(pose[0] for pose in places if meets(goal, pose)) for goal in self.liveness
        ]
        return tuple(regions or everywhere for regions in found)

    def steps(self, before: Pose, after: Pose) -> Iterable[tuple[int, int, frozenset[int]]]:
        """The memory (by number) before and after with which the step is allowed, and the goals
        that it meets."""
        for i, old in enumerate(self.valuations):
            for j, new in enumerate(self.valuations):
                one, other = {**_values(before), **old}, {**_values(after), **new}
                if all(formula(one, other) for formula in self.safety):
                    met = (k for k, goal in enumerate(self.liveness) if goal(one, other))
                    yield i, j, frozenset(met)


def read_formulas(body: Mapping[str, object]) -> Formulas:
    """The guarantees in the body of an ``ltl`` objective. Raises UnreadError."""
    listed = body.get("memory") or {}
    if not isinstance(listed, Mapping):
        raise UnreadError("memory")
    memory = {str(name): _range(kind) for name, kind in listed.items()}
    memory |= {name: range(2) for name in _lines(body, "inputs")}  # any values may come
    count = 1
    for values in memory.values():
        count *= len(values)
    if count > MOST_VALUATIONS:
        raise UnreadError(f"{count} valuations of the memory")
    known = {"region", "heading", *memory}
    return Formulas(
        tuple(_Parser(line, known).whole() for line in _lines(body, "safety")),
        tuple(_Parser(line, known).whole() for line in _lines(body, "liveness")),
        memory,
    )


@lru_cache(maxsize=64)
def rules_of(objective: Objective) -> Formulas:
    """The formulas that an objective of another kind always keeps. Raises UnreadError."""
    return read_formulas({"safety": list(objective.always)})


def _values(pose: Pose) -> dict[str, int]:
    region, heading = pose
    return {"region": region, "heading": -1 if heading is None else _HEADINGS[heading]}


def _range(kind: object) -> range:
    if kind == "bool":
        return range(2)
    if isinstance(kind, list) and len(kind) == 2 and all(type(one) is int for one in kind):
        return range(kind[0], kind[1] + 1)
    raise UnreadError(f"the memory {kind!r}")


def _lines(body: Mapping[str, object], key: str) -> list[str]:
    value = body.get(key) or []
    lines = [value] if isinstance(value, str) else value
    if not isinstance(lines, list) or not all(isinstance(line, str) for line in lines):
        raise UnreadError(key)
    return [str(line) for line in lines]


class _Parser:
    """Infix formulas, from the operator that binds least to the one that binds most."""

    def __init__(self, text: str, known: set[str]) -> None:
        self._known = known
        self._tokens: list[str] = []
        at = 0
        while text[at:].strip():
            found = _TOKEN.match(text, at)
            if found is None:
                raise UnreadError(text)
            self._tokens.append(_SAME.get(found[1], found[1]))
            at = found.end()
        self._at = 0

    def whole(self) -> Formula:
        found = self._arrows()
        if self._at < len(self._tokens):
            raise UnreadError(" ".join(self._tokens))
        return found

    def _peek(self) -> str:
        return self._tokens[self._at] if self._at < len(self._tokens) else ""

    def _take(self, *wanted: str) -> str:
        token = self._peek()
        if not token or (wanted and token not in wanted):
            raise UnreadError(" ".join(self._tokens))
        self._at += 1
        return token

    def _arrows(self) -> Formula:
        return self._chain(("<->",), lambda: self._chain(("->",), self._exclusive))

    def _exclusive(self) -> Formula:
        return self._chain(("^",), lambda: self._chain(("|",), self._both))

    def _both(self) -> Formula:
        return self._chain(("&",), self._unary)

    def _chain(self, operators: tuple[str, ...], inner: Callable[[], Formula]) -> Formula:
        found = inner()
        while self._peek() in operators:
            found = _joined(self._take(), found, inner())
        return found

    def _unary(self) -> Formula:
        if self._peek() == "!":
            self._take()
            inner = self._unary()
            return lambda a, b: int(not inner(a, b))
        return self._comparison()

    def _comparison(self) -> Formula:
        left = self._sum()
        if self._peek() in _COMPARED:
            operator = _COMPARED[self._take()]
            right = self._sum()
            return lambda a, b: int(operator(left(a, b), right(a, b)))
        return left

    def _sum(self) -> Formula:
        found = self._operand()
        while self._peek() == "+":
            self._take()
            found = _added(found, self._operand())
        return found

    def _operand(self) -> Formula:
        token = self._take()
        if token == "(":
            inner = self._arrows()
            self._take(")")
            if self._peek() != "'":
                return inner
            self._take()
            return lambda _, b: inner(b, b)
        if token in ("next", "X"):
            self._take("(")
            later = self._arrows()
            self._take(")")
            return lambda _, b: later(b, b)
        if token.isdigit():
            return _constant(int(token))
        if token in ("TRUE", "FALSE"):
            return _constant(int(token == "TRUE"))
        if token in _HEADINGS and token not in self._known:
            return _constant(_HEADINGS[token])
        name = token.rstrip("'")
        if name not in self._known:
            raise UnreadError(token)
        return (lambda _, b: b[name]) if token.endswith("'") else (lambda a, _: a[name])


_COMPARED: Mapping[str, Callable[[int, int], bool]] = {
    "=": lambda x, y: x == y,
    "!=": lambda x, y: x != y,
    "<": lambda x, y: x < y,
    "<=": lambda x, y: x <= y,
    ">": lambda x, y: x > y,
    ">=": lambda x, y: x >= y,
}


def _constant(value: int) -> Formula:
    return lambda _a, _b: value


def _added(one: Formula, other: Formula) -> Formula:
    return lambda a, b: one(a, b) + other(a, b)


def _joined(operator: str, one: Formula, other: Formula) -> Formula:
    match operator:
        case "&":
            return lambda a, b: int(bool(one(a, b)) and bool(other(a, b)))
        case "|":
            return lambda a, b: int(bool(one(a, b)) or bool(other(a, b)))
        case "^":
            return lambda a, b: int(bool(one(a, b)) is not bool(other(a, b)))
        case "->":
            return lambda a, b: int(not one(a, b) or bool(other(a, b)))
        case _:
            return lambda a, b: int(bool(one(a, b)) is bool(other(a, b)))
