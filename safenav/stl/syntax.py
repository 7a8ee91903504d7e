"""Formulas of signal temporal logic as data (docs/motion.md, "Requirements on the motion")."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field
from math import inf

from safenav.dataclass import dataclass

ARGUMENTS = {"distance": 2, "speed": 1, "height": 1, "x": 1, "y": 1}
"""The signals of robots, and how many robots each takes. Metres, and metres per second."""

EVENTS = ("requested", "resolved")


@dataclass(frozen=True)
class RobotSignal:
    """``distance(a, b)``: a signal of the motion of one or two robots."""

    name: str
    robots: tuple[str, ...]
    columns: tuple[int, ...] = field(default=(), compare=False)


@dataclass(frozen=True)
class Literal:
    """A number."""

    value: float


@dataclass(frozen=True)
class Arithmetic:
    """``left + right``, ``left - right`` or ``left * right``."""

    operator: str
    left: SignalTerm
    right: SignalTerm


@dataclass(frozen=True)
class Margin:
    """``term >= 0``: its robustness is the term."""

    term: SignalTerm


@dataclass(frozen=True)
class Happens:
    """``requested_door@47``: 1 at the instants of the event, -1 at all others."""

    kind: str
    obstacle: str
    column: int = field(default=0, compare=False)


@dataclass(frozen=True)
class Negation:
    operand: Requirement


@dataclass(frozen=True)
class Junction:
    """``left and right``, ``left or right``."""

    operator: str
    left: Requirement
    right: Requirement


@dataclass(frozen=True)
class Window:
    """Seconds from ``begin`` to ``end``, both included."""

    begin: float = 0.0
    end: float = inf


@dataclass(frozen=True)
class Within:
    """``always``, ``eventually`` (the future), ``historically`` or ``once`` (the past)."""

    operator: str
    window: Window
    operand: Requirement


@dataclass(frozen=True)
class UntilSince:
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
