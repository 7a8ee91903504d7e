"""Formulas of signal temporal logic as data (docs/motion.md, "Requirements on the motion")."""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

from msgspec import Struct

ARGUMENTS = {"distance": 2, "speed": 1, "height": 1, "x": 1, "y": 1}
"""The signals of robots (metres, metres per second), and how many robots each takes."""

EVENTS = ("requested", "resolved")


class RobotSignal(Struct, frozen=True):
    """``distance(a, b)``: a signal of the motion of one or two robots."""

    name: str
    robots: tuple[str, ...]
    columns: tuple[int, ...] = ()


class Literal(Struct, frozen=True):
    """A number."""

    value: float


class Arithmetic(Struct, frozen=True):
    """``left + right``, ``left - right`` or ``left * right``."""

    operator: str
    left: SignalTerm
    right: SignalTerm


class Margin(Struct, frozen=True):
    """``term >= 0``: its robustness is the term."""

    term: SignalTerm


class Happens(Struct, frozen=True):
    """``requested_door@47``: 1 at the instants of the event, -1 at all others."""

    kind: str
    obstacle: str
    column: int = 0


class Negation(Struct, frozen=True):
    operand: Requirement


class Junction(Struct, frozen=True):
    """``left and right``, ``left or right``."""

    operator: str
    left: Requirement
    right: Requirement


class Window(Struct, frozen=True):
    """Seconds from ``begin`` to ``end``, both included."""

    begin: float = 0.0
    end: float = inf


class Within(Struct, frozen=True):
    """``always``, ``eventually`` (the future), ``historically`` or ``once`` (the past)."""

    operator: str
    window: Window
    operand: Requirement


class UntilSince(Struct, frozen=True):
    """``left until right``, or into the past ``left since right``."""

    operator: str
    window: Window
    left: Requirement
    right: Requirement


SignalTerm = RobotSignal | Literal | Arithmetic
Requirement = Margin | Happens | Negation | Junction | Within | UntilSince
Node = SignalTerm | Requirement

PAST = frozenset({"once", "historically", "since"})
UNIVERSAL = frozenset({"always", "historically"})


def children(tree: Node) -> tuple[Node, ...]:
    """The parts of a node, from left to right."""
    match tree:
        case Margin(term):
            return (term,)
        case Negation(operand) | Within(_, _, operand):
            return (operand,)
        case Arithmetic(_, left, right) | Junction(_, left, right) | UntilSince(_, _, left, right):
            return (left, right)
        case _:
            return ()


def nodes(tree: Node) -> Iterator[Node]:
    """The tree and everything below it, from left to right."""
    yield tree
    for child in children(tree):
        yield from nodes(child)
