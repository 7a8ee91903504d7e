"""The language of formulas (docs/scenario.md), and what all checks share.

Formulas become Python functions of the values of variables; a variable's name with a prime is its
next value.
"""

from __future__ import annotations

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


class Clause(NamedTuple):
    """A formula, the variables that it reads, and its Python expression."""

    text: str
    reads: frozenset[Key]
    code: str


_TOKEN = re.compile(
    r"(?a)\s*(\d+|[A-Za-z_]\w*'*|<-->|<->|-->|->|&&|\|\||/\\|\\/|!=|<=|>=|[!~&|^=<>+()])"
)
_SAME = {"&&": "&", "/\\": "&", "||": "|", "\\/": "|", "-->": "->", "<-->": "<->", "~": "!"}
# Precedence of the operators (they associate to the left) and their form in Python. Truth values
# are 0 and 1, so an implication is a comparison.
_SIGNS = {"<->": (1, "=="), "->": (2, "<="), "^": (3, "!="), "|": (4, "or"), "&": (5, "and")}
_SIGNS |= {"=": (7, "=="), "+": (8, "+"), **{s: (7, s) for s in ("!=", "<", "<=", ">", ">=")}}
_NOT, _COMPARES, _TIGHTEST = 6, 7, 9
_NUMBERS = {"FALSE": 0, "TRUE": 1} | {heading: k for k, heading in enumerate(HEADINGS)}


def name_of(key: Key) -> str:
    """Return the Python name of a variable."""
    return f"next_{key[:-1]}" if key.endswith("'") else f"now_{key}"


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

    def check(parts: list[tuple[str, bool]], truth: bool) -> list[str]:
        good = all(is_truth is truth for _, is_truth in parts)
        require(good, f"'{text}' uses a number as a condition, or a condition as a number")
        return [code for code, _ in parts]

    def read(least: int, prime: str) -> tuple[str, bool]:
        """Return the longest expression of operators with at least this precedence, and whether it
        is a truth value. Within next(...) each variable gets a prime."""
        token = tokens.pop()
        value = str(_NUMBERS.get(token, token)), token in ("TRUE", "FALSE")
        if token in ("next", "X") and tokens[-1] == "(":
            value = read(_TIGHTEST, f"{prime}'")
        elif token == "(":
            value = read(0, prime)
            require(tokens.pop() == ")", f"'(' is not closed in '{text}'")
        elif token == "!":
            value = f"(not {check([read(_NOT, prime)], True)[0]})", True
        elif token.isdigit():
            value = str(int(token)), False
        elif token not in _NUMBERS:
            require(re.fullmatch(r"\w+'?", token + prime), f"unexpected '{token}' in '{text}'")
            reads.add(token + prime)
            value = name_of(token + prime), token.rstrip("'") in truths
        while _SIGNS.get(sign := tokens[-1], (-1,))[0] >= least:
            (strength, word), parts = _SIGNS[sign], [value]
            while tokens[-1] == sign and (len(parts) < 2 or word in ("and", "or", "+")):
                tokens.pop()
                parts.append(read(strength + 1, prime))
            code = f" {word} ".join(check(parts, strength < _NOT))
            value = f"({code})", strength <= _COMPARES
        return value

    try:
        (code,) = check([read(0, "")], True)
    except RecursionError:
        raise RefusedError(f"'{text[:20]}' ... is nested too deeply") from None
    require(len(tokens) == 1, f"unexpected '{tokens[-1]}' in '{text}'")
    return Clause(text, frozenset(reads), code)


@cache
def function_of(keys: Keys, clauses: Sequence[Clause]) -> Any:
    """Return a function of the values of ``keys`` that tells whether all clauses hold. The
    evaluated code comes only from ``read_clause``."""
    code = " and ".join(clause.code for clause in clauses) or "True"
    try:
        return eval(f"lambda {', '.join(map(name_of, keys))}: {code}")
    except (SyntaxError, RecursionError, MemoryError):  # Python's own limits
        raise RefusedError(f"'{code[:20]}' ... is nested too deeply") from None


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
