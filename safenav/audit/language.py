"""The language of formulas (docs/scenario.md), and what all checks share.

Formulas become functions of the values of variables, built from closures: no text of a file is ever
evaluated as code. A variable's name with a prime is its next value.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from functools import cache
from math import inf
from typing import Any, NamedTuple

MOST_STATES = 200_000
MOST_CASES = 1_000_000
HEADINGS = ("north", "east", "south", "west")

Key = str  # a variable's name, followed by ' for its next value
Keys = Sequence[Key]
Row = tuple[int, ...]  # values of variables; a truth is 0 or 1
Pose = tuple[int, str | None]  # a region, and the heading of robots that have one


class RefusedError(Exception):
    """The evidence does not prove the claim; the message states why."""


class TooLargeError(Exception):
    """The evidence is larger than this checker accepts."""


def require(holds: object, reason: str) -> None:
    if not holds:
        raise RefusedError(reason)


def closure(
    starts: Iterable[Any], after: Callable[[Any], Iterable[Any]], most: float = inf
) -> list[Any]:
    """Return all states reachable from ``starts``. Raises TooLargeError beyond ``most`` states."""
    queue = [*dict.fromkeys(starts)]
    found = {*queue}
    for state in queue:
        for other in after(state):
            if other not in found:
                found.add(other)
                queue.append(other)
        if len(queue) > most:
            raise TooLargeError(f"more than {most} states; not certified")
    return queue


def distance(
    starts: Iterable[Any], after: Callable[[Any], Iterable[Any]], there: AbstractSet[Any]
) -> int | None:
    """Return the number of steps to the nearest state of ``there``; None if there is no path."""
    edge = {*starts}
    seen, count = edge, 0
    while edge and not edge & there:
        edge = {other for state in edge for other in after(state)} - seen
        seen, count = seen | edge, count + 1
    return count if edge else None


Value = Callable[[Row], int]  # of an expression: a number, or a truth (0 or 1)
Bind = Callable[[Mapping[Key, int]], Value]  # given the position of each variable in a row


class Clause:
    """A formula and the variables that it reads. ``bind``: its value as a function of a row, given
    the position of each variable there. No text becomes code."""

    def __init__(self, text: str, reads: frozenset[Key], bind: Bind) -> None:
        self.text, self.reads, self.bind = text, reads, bind


MOST_LEVELS = 200
"""Deepest nesting of a formula: its functions call each other."""
MOST_DIGITS = 10

_TOKEN = re.compile(
    r"(?a)\s*(\d+|[A-Za-z_]\w*'*|<-->|<->|-->|->|&&|\|\||/\\|\\/|!=|<=|>=|[!~&|^=<>+()])"
)
_SAME = {"&&": "&", "/\\": "&", "||": "|", "\\/": "|", "-->": "->", "<-->": "<->", "~": "!"}
# Precedence of the operators; they associate to the left.
_STRENGTH = {"<->": 1, "->": 2, "^": 3, "|": 4, "&": 5, "+": 8}
_STRENGTH |= dict.fromkeys(("=", "!=", "<", "<=", ">", ">="), 7)
_NOT, _COMPARES, _TIGHTEST = 6, 7, 9
_NUMBERS = {"FALSE": 0, "TRUE": 1} | {heading: k for k, heading in enumerate(HEADINGS)}
_PAIRS: dict[str, Callable[[Any, Any], Any]] = {
    **{"=": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le},
    **{">": operator.gt, ">=": operator.ge, "<->": operator.eq, "^": operator.ne},
}


class _Part(NamedTuple):
    """A part of a formula: how it is evaluated, whether it is a truth, its nesting, and its
    ``number`` if it is one."""

    bind: Bind
    truth: bool
    levels: int = 0
    number: int | None = None


def _both(sign: str, parts: Sequence[_Part]) -> Bind:
    """Return the value of an operator on its operands: two, or several of '&', '|' or '+'."""

    def bind(at: Mapping[Key, int]) -> Value:
        values, number = [part.bind(at) for part in parts], parts[-1].number
        if sign == "+":
            return lambda row: sum(value(row) for value in values)
        if sign in "&|":
            return _every(values) if sign == "&" else _some(values)
        left, right = values
        if sign == "->":
            return lambda row: not left(row) or right(row)
        pair = _PAIRS[sign]
        if number is not None:  # most comparisons are with one
            return lambda row: pair(left(row), number)
        return lambda row: pair(left(row), right(row))

    return bind


def _some(values: Sequence[Value]) -> Value:
    """Return a disjunction. A loop takes half the time of ``any``."""

    def value(row: Row) -> bool:
        for each in values:  # noqa: SIM110
            if each(row):
                return True
        return False

    return value


def _every(values: Sequence[Value]) -> Value:
    """Return a conjunction, likewise."""

    def value(row: Row) -> bool:
        for each in values:  # noqa: SIM110
            if not each(row):
                return False
        return True

    return value


def primed(names: Iterable[str]) -> list[Key]:
    return [f"{name}'" for name in names]


@cache
def read_clause(text: str, truths: frozenset[str]) -> Clause:
    """Parse a clause; results are cached, because the strategies of a run share most clauses.
    ``truths``: the Boolean variables. Raises RefusedError."""
    rest = _TOKEN.sub("", text).strip()
    require(not rest, f"cannot read '{rest[:20]}'")
    tokens = ["the end", *(_SAME.get(token, token) for token in reversed(_TOKEN.findall(text)))]
    reads: set[Key] = set()

    def demand(parts: Iterable[_Part], truth: bool) -> None:
        good = all(part.truth is truth for part in parts)
        require(good, f"'{text}' uses a number as a condition, or a condition as a number")

    def within(levels: int) -> int:
        require(levels <= MOST_LEVELS, f"'{text[:20]}' ... is nested too deeply")
        return levels

    def constant(number: int, *, truth: bool = False) -> _Part:
        return _Part(lambda _: lambda _: number, truth, number=None if truth else number)

    def variable(key: Key, name: str) -> _Part:
        require(re.fullmatch(r"\w+'?", key), f"unexpected '{name}' in '{text}'")
        reads.add(key)
        return _Part(lambda at: operator.itemgetter(at[key]), name.rstrip("'") in truths)

    def operand(prime: str, depth: int) -> _Part:
        token = tokens.pop()
        if token in ("next", "X") and tokens[-1] == "(":
            return read(_TIGHTEST, f"{prime}'", depth)
        if token == "(":
            part = read(0, prime, depth)
            require(tokens.pop() == ")", f"'(' is not closed in '{text}'")
            return part
        if token == "!":
            part = read(_NOT, prime, depth)
            demand([part], True)
            return _Part(lambda at: _negation(part.bind(at)), True, within(part.levels + 1))
        if token.isdigit():
            require(len(token) <= MOST_DIGITS, f"'{text[:20]}' ... has a number that is too large")
            return constant(int(token))
        if token in _NUMBERS:
            return constant(_NUMBERS[token], truth=token in ("TRUE", "FALSE"))
        return variable(token + prime, token)

    def read(least: int, prime: str, depth: int) -> _Part:
        """Return the longest expression of operators with at least this precedence. Within
        next(...) each variable gets a prime."""
        part = operand(prime, within(depth + 1))
        while (strength := _STRENGTH.get(sign := tokens[-1], -1)) >= least:
            parts = [part]
            while tokens[-1] == sign and (len(parts) < 2 or sign in "&|+"):
                tokens.pop()
                parts.append(read(strength + 1, prime, depth + 1))
            demand(parts, strength < _NOT)
            levels = within(max(each.levels for each in parts) + 1)
            part = _Part(_both(sign, parts), strength <= _COMPARES, levels)
        return part

    demand([whole := read(0, "", 0)], True)
    require(len(tokens) == 1, f"unexpected '{tokens[-1]}' in '{text}'")
    return Clause(text, frozenset(reads), whole.bind)


def _negation(value: Value) -> Value:
    return lambda row: not value(row)


@cache
def function_of(keys: Keys, clauses: Sequence[Clause]) -> Any:
    """Return a function of the values of ``keys`` that tells whether all clauses hold."""
    at = {key: place for place, key in enumerate(keys)}
    holds = _every([clause.bind(at) for clause in clauses])
    return lambda *row: holds(row)


def complete(
    ranges: Mapping[Key, range], wanted: Keys, clauses: Sequence[Clause], known: Mapping[Key, int]
) -> set[Row]:
    """Return all rows of values of the ``wanted`` variables that satisfy the clauses together with
    the known values. A clause is evaluated as soon as all values that it reads are known. Raises
    TooLargeError."""
    if not wanted and not clauses:
        return {()}
    steps, found = _steps((*known,), (*wanted,), (*clauses,)), [(*known.values(),)]
    for key, holds in zip(("", *wanted), steps, strict=True):
        if key and len(found) * len(ranges[key]) > MOST_CASES:
            raise TooLargeError(f"more than {MOST_CASES} cases of {', '.join(wanted)}")
        if key:
            found = [(*row, value) for row in found for value in ranges[key]]
        found = [row for row in found if holds(*row)]
    return {row[len(known) :] for row in found}


@cache
def _steps(names: tuple[Key, ...], wanted: tuple[Key, ...], clauses: tuple[Clause, ...]) -> Any:
    """Return functions that evaluate the clauses: first those over ``names``, then those that each
    further ``wanted`` variable makes complete."""
    found = []
    for key in ("", *wanted):
        names = (*names, key) if key else names
        every = {*names}
        ready = (c for c in clauses if c.reads <= every and (not key or key in c.reads))
        found.append(function_of(names, (*ready,)))
    unknown = set().union(*(clause.reads for clause in clauses)) - {*names}
    require(not unknown, f"a formula uses unknown variables: {', '.join(sorted(unknown))}")
    return found


def named(*poses: Pose) -> dict[Key, int]:
    """Return a pose, or a pose and the next one, as values of variables."""
    each = [*zip(poses, ("", "'"), strict=False)]
    regions = {f"region{prime}": region for (region, _), prime in each}
    return regions | {f"heading{prime}": HEADINGS.index(h) for (_, h), prime in each if h}
