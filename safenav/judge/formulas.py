"""Formulas of objectives (docs/scenario.md) as closures.

No text of a file is ever evaluated as code. A variable with a prime denotes its next value.
"""

import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from itertools import product
from math import prod
from typing import Any, NamedTuple

HEADINGS = ("north", "east", "south", "west")
MOST_VALUES = 64
"""Maximum number of memory values; formulas with more are not judged."""
MOST_WORK = 2_000_000
"""Maximum number of symbols evaluated for a step with all memory values."""
MOST_LEVELS, MOST_DIGITS = 200, 10

Pose = tuple[int, "str | None"]  # a region, and a heading if the robot has headings
Values = Mapping[str, int]  # values of variables: truth values are 0 and 1


class UnreadError(Exception):
    """A formula that the judge cannot read. The message states the reason."""


class Part(NamedTuple):
    """A formula or a part of it. ``value``: a function that maps its variables' values to its
    value; ``truth``: whether this is a truth value, not a number; ``names``: its variables;
    ``levels``: its depth of nesting."""

    value: Callable[[Values], Any]
    truth: bool
    names: frozenset[str]
    levels: int = 0


_TOKEN = re.compile(
    r"(?a)\s+|(\d+|[A-Za-z_]\w*'*|<-->|<->|-->|->|&&|\|\||/\\|\\/|!=|<=|>=|[!~&|^=<>+()])"
)
_SAME = {"&&": "&", "/\\": "&", "||": "|", "\\/": "|", "-->": "->", "<-->": "<->", "~": "!"}
_STRENGTH = {"<->": 1, "->": 2, "^": 3, "|": 4, "&": 5, "+": 8}
_STRENGTH |= dict.fromkeys(("=", "!=", "<", "<=", ">", ">="), 7)
_NOT, _COMPARES, _TIGHTEST = 6, 7, 9
_CONSTANTS = {"FALSE": 0, "TRUE": 1} | {heading: k for k, heading in enumerate(HEADINGS)}
_FOLDS: dict[str, Callable[[Iterable[Any]], Any]] = {"+": sum, "&": all, "|": any}
_PAIRS: dict[str, Callable[[Any, Any], Any]] = {
    **{"=": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le},
    **{">": operator.gt, ">=": operator.ge, "<->": operator.eq, "^": operator.ne},
    "->": operator.le,  # on truth values
}


def _tokens(text: str) -> list[str]:
    return [token for token in _TOKEN.findall(text) if token]


def _joined(sign: str, parts: Sequence[Part]) -> Callable[[Values], Any]:
    values = [part.value for part in parts]
    if fold := _FOLDS.get(sign):
        return lambda at: fold(value(at) for value in values)
    (left, right), pair = values, _PAIRS[sign]
    return lambda at: pair(left(at), right(at))


class _Parser:
    """Parser of a formula. ``truths``: its Boolean variables. Operators associate to the left."""

    def __init__(self, text: str, truths: frozenset[str]) -> None:
        self.text, self.truths = text, truths
        rest = _TOKEN.sub("", text)
        self.require(not rest, f"cannot read '{rest[:20]}'")
        self.left = ["the end", *(_SAME.get(t, t) for t in reversed(_tokens(text)))]

    def require(self, holds: object, problem: str) -> None:
        if not holds:
            raise UnreadError(f"{problem} in the formula '{self.text[:40]}'")

    def whole(self) -> Part:
        part = self.read(0, "", 0)
        self.require(part.truth and len(self.left) == 1, f"unexpected '{self.left[-1]}'")
        return part

    def read(self, least: int, prime: str, depth: int) -> Part:
        """Return the longest expression of operators with at least this precedence. Variables
        within ``next(...)`` get a prime."""
        self.require(depth < MOST_LEVELS, "too much nesting")
        part = self.operand(prime, depth)
        while (strength := _STRENGTH.get(sign := self.left[-1], -1)) >= least:
            parts = [part]
            while self.left[-1] == sign and (len(parts) < 2 or sign in "&|+"):
                self.left.pop()
                parts.append(self.read(strength + 1, prime, depth + 1))
            takes = strength < _NOT  # these take truth values, other signs numbers
            self.require(all(each.truth is takes for each in parts), f"wrong operands of '{sign}'")
            levels = max(each.levels for each in parts) + 1
            self.require(levels < MOST_LEVELS, "too much nesting")
            names = frozenset[str]().union(*(each.names for each in parts))
            part = Part(_joined(sign, parts), strength <= _COMPARES, names, levels)
        return part

    def operand(self, prime: str, depth: int) -> Part:
        token, none = self.left.pop(), frozenset[str]()
        if token in ("next", "X") and self.left[-1] == "(":
            return self.read(_TIGHTEST, f"{prime}'", depth + 1)
        if token == "(":
            part = self.read(0, prime, depth + 1)
            self.require(self.left.pop() == ")", "'(' is not closed")
            return part
        if token == "!":
            part = self.read(_NOT, prime, depth + 1)
            self.require(part.truth, "wrong operand of '!'")
            value = part.value
            return part._replace(value=lambda at: not value(at), levels=part.levels + 1)
        if token.isdigit() or token in _CONSTANTS:
            self.require(len(token) <= MOST_DIGITS, "a number that is too large")
            number = _CONSTANTS[token] if token in _CONSTANTS else int(token)
            return Part(lambda _: number, token in ("TRUE", "FALSE"), none)
        key = token + prime
        self.require(re.fullmatch(r"(?a)[A-Za-z_]\w*'?", key), f"unexpected '{token}'")
        name = token.rstrip("'")
        return Part(operator.itemgetter(key), name in self.truths, frozenset([name]))


@cache
def read_formula(text: str, truths: frozenset[str]) -> Part:
    """Return the formula in a text. Raises UnreadError."""
    return _Parser(text, truths).whole()


class Formulas:
    """The safety formulas, goals and memory of a robot's objective. ``values``: all joint values of
    the memory and the inputs; a *memory* is an index in this list. ``fixed``: variables with a
    single possible value. ``whole``: whether all formulas are evaluated; otherwise the memory has
    too many values, and the formulas that read it are omitted."""

    def __init__(self, body: Mapping[str, Any], always: Iterable[str] = ()) -> None:
        memory = body.get("memory") or {}
        self.inputs: list[str] = [*body.get("inputs", ())]
        self.names = [*memory, *self.inputs]
        if len({"region", "heading", *self.names}) < len(self.names) + 2:
            raise UnreadError("two variables of formulas have one name")
        ranges = [range(2) if kind == "bool" else range(kind[0], kind[1] + 1)
                  for kind in memory.values()] + [range(2)] * len(self.inputs)  # fmt: skip
        pairs = zip(self.names, ranges, strict=True)
        self.fixed = {name: values[0] for name, values in pairs if len(values) == 1}
        truths = frozenset([*self.inputs, *(k for k, kind in memory.items() if kind == "bool")])
        texts = {part: [*body.get(part, ())] for part in ("init", "safety", "liveness")}
        texts["safety"] += [f"region' = region | ({text})" for text in always]
        size = sum(len(_tokens(text)) for each in texts.values() for text in each)
        # Further variables do not count, since the product of too many values takes long.
        count = prod(map(len, ranges[: MOST_VALUES + len(self.fixed)]))
        self.work = size * count**2
        self.whole = count <= MOST_VALUES and self.work <= MOST_WORK
        self.values: list[tuple[int, ...]] = [*product(*ranges)] if self.whole else [()]
        self._all = {part: [read_formula(x, truths) for x in each] for part, each in texts.items()}
        for part in (part for each in self._all.values() for part in each):
            if unknown := part.names - {"region", "heading", *self.names}:
                raise UnreadError(f"unknown names in a formula: {', '.join(sorted(unknown))}")
        unread = frozenset[str]() if self.whole else frozenset(self.names)
        self._init, self._safety, self.goals = (
            [part.value for part in each if unread.isdisjoint(part.names)]
            for each in self._all.values()
        )
        self.count = len(self._all["liveness"])
        self.steps = cache(self._steps)

    def begins(self, pose: Pose) -> list[int]:
        """Return the possible memories of a robot that begins in a pose."""
        every = enumerate(self.values)
        rows = ((i, self._row(pose, pose, row, row)) for i, row in every)
        return [i for i, at in rows if all(holds(at) for holds in self._init)]

    def remembering(self, stated: Mapping[str, int]) -> set[int]:
        """Return the memories in which the variables ``stated`` have the stated values."""
        rows = (zip(self.names, row, strict=False) for row in self.values)
        agree = (all(stated.get(name, value) == value for name, value in row) for row in rows)
        return {number for number, agrees in enumerate(agree) if agrees}

    def _steps(self, before: Pose, after: Pose) -> list[tuple[int, int, frozenset[int]]]:
        """Return each step that safety allows as (memory before, memory after, goals met)."""
        found = []
        for (i, old), (j, new) in product(enumerate(self.values), repeat=2):
            at = self._row(before, after, old, new)
            if all(holds(at) for holds in self._safety):
                found.append((i, j, frozenset(k for k, g in enumerate(self.goals) if g(at))))
        return found

    def allows(self, before: Pose, after: Pose) -> bool:
        """Return whether the safety formulas allow a step for at least one memory."""
        return bool(self.steps(before, after))

    def holds(
        self, part: str, before: Pose, old: Sequence[int], after: Pose, new: Sequence[int]
    ) -> list[bool]:
        """Return, for each formula of ``part`` (``init``, ``safety`` or ``liveness``), whether it
        holds for a step with these values of memory and inputs before and after it."""
        at = self._row(before, after, old, new)
        return [bool(formula.value(at)) for formula in self._all[part]]

    def meets(self, goal: int, before: Pose, after: Pose) -> bool:
        """Return whether a step meets a goal for at least one memory, ignoring safety formulas."""
        rows = product(self.values, repeat=2)
        return any(self.goals[goal](self._row(before, after, *row)) for row in rows)

    def met_by_staying(self, pose: Pose, memory: int) -> frozenset[int]:
        """Return the goals that a robot with this memory meets by staying in a pose."""
        row = self.values[memory]
        at = self._row(pose, pose, row, row)
        return frozenset(k for k, goal in enumerate(self.goals) if goal(at))

    def after(self, memories: Iterable[int], before: Pose, then: Pose) -> set[int]:
        """Return the memories that a robot may have after a step, given those before it."""
        known = {*memories}
        return {j for i, j, _ in self.steps(before, then) if i in known}

    def lasting(self, memories: Iterable[int], pose: Pose, heard: set[int]) -> set[int]:
        """Return the memories that a robot may have after any number of stays in ``pose``, with
        inputs as in ``heard``."""
        known = {*memories}
        while more := (self.after(known, pose, pose) & heard) - known:
            known |= more
        return known

    def hearing(self, memories: set[int], heard: Iterable[int]) -> set[int]:
        """Return ``memories`` and those of ``heard`` that equal one of them except in inputs."""
        own = len(self.names) - len(self.inputs)
        known = {self.values[one][:own] for one in memories}
        return memories | {one for one in heard if self.values[one][:own] in known}

    def _row(self, before: Pose, after: Pose, old: Sequence[int], new: Sequence[int]) -> Values:
        (a, faced), (b, faces) = before, after
        at = {"region": a, "region'": b, "heading": _number(faced), "heading'": _number(faces)}
        for name, value, later in zip(self.names, old, new, strict=False):
            at[name], at[f"{name}'"] = value, later
        return at


def _number(heading: str | None) -> int:
    return -1 if heading is None else HEADINGS.index(heading)
