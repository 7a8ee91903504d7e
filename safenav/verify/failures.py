"""Findings of an independent check of an automaton."""

from __future__ import annotations

from enum import StrEnum

from msgspec import Struct

from safenav.spec.specification import Constraint


class Fault(StrEnum):
    """Defects of an automaton; the value is the wording."""

    NO_START = "no node to start from"
    RANGE = "a value outside its range"
    FORBIDDEN_INPUT = "a next input that the assumptions exclude"
    SEVERAL_INPUTS = "the environment does not choose one next input"
    MISSING_SUCCESSOR = "no successor for an allowed move of the other player"
    SEVERAL_SUCCESSORS = "two successors for the same move of the other player"
    BROKEN_GUARANTEE = "a transition that breaks a guarantee"
    STARVED_GOAL = "a cycle that meets all assumptions, but not this goal"
    STARVED_ASSUMPTION = "a cycle on which the environment does not meet this assumption"
    GOALS_MET = "a cycle on which the system meets all its goals"


class Failure(Struct, frozen=True):
    """A fault, and a path to it.

    ``node``: its node, None if it concerns no node; ``state``: that node in words. ``successor``:
    the other end of a wrong transition. ``constraint``: the violated constraint, with its origin.
    ``path``: a shortest one from an initial node to ``node``. ``cycle``: nodes of a closed walk
    from ``node``, for faults of liveness. ``detail``: the move in question.
    """

    fault: Fault
    node: int | None = None
    successor: int | None = None
    constraint: Constraint | None = None
    path: tuple[int, ...] = ()
    cycle: tuple[int, ...] = ()
    state: str = ""
    detail: str = ""

    def __str__(self) -> str:
        lines = [self.fault.value]
        if self.node is not None:
            lines[0] += f" at node {self.node} ({self.state})"
        if self.detail:
            lines.append(self.detail)
        if self.constraint is not None:
            lines.append(f"constraint: {self.constraint.formula}")
            lines.append(f"from: {self.constraint.origin}")
        if self.path:
            lines.append("path: " + _arrows(self.path))
        if self.cycle:
            lines.append("cycle: " + _arrows((*self.cycle, self.cycle[0])))
        return "\n    ".join(lines)


class Verification(Struct, frozen=True):
    """Result of a check. ``failures``: the shallowest one of each kind and constraint; ``nodes``,
    ``edges``: how many were reached and checked. ``vacuous``: no initial state satisfies the
    assumptions, so the strategy guarantees nothing."""

    failures: tuple[Failure, ...]
    nodes: int
    edges: int
    vacuous: bool = False

    @property
    def ok(self) -> bool:
        return not self.failures


def _arrows(nodes: tuple[int, ...]) -> str:
    shown = [str(node) for node in nodes]
    if len(shown) > 40:
        shown[20:-20] = ["..."]
    return " -> ".join(shown)
