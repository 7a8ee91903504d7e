"""A robot's turn, the status of obstacles, and entries of the objective stack."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto

from safenav.audit.lines import Line, Objective
from safenav.audit.run.progress import Progress


class Status(Enum):
    """Status of an obstacle."""

    ABSENT = auto()
    """It has not appeared yet, or has disappeared."""
    UNRESOLVED = auto()
    RESOLVED = auto()
    UNTRAVERSABLE = auto()
    """Resolved, and found to be a permanent obstacle."""
    GIVEN_UP = auto()
    """No robot can resolve it: the robots that it blocks plan around it."""

    @property
    def stays(self) -> bool:
        """Return whether the team plans around it from now on."""
        return self in (Status.UNTRAVERSABLE, Status.GIVEN_UP)

    @property
    def unmet(self) -> bool:
        """Return whether it is present with open needs."""
        return self in (Status.UNRESOLVED, Status.GIVEN_UP)

    @property
    def away(self) -> bool:
        """Return whether it is absent, or resolved."""
        return self in (Status.ABSENT, Status.RESOLVED)


FINAL = ("untraversable", "operator")
"""Reasons for which an obstacle is permanent."""


ROUNDED = 1e-6
"""Seconds by which sums of written times may differ."""


@dataclass(frozen=True)
class StackEntry:
    """An entry of the objective stack: helpers, requester and obstacle; ``before``: the stored
    objectives, from before the push; ``helped``: the obstacle with which each robot then helped."""

    obstacle: str | None
    requester: str | None
    helpers: tuple[str, ...]
    line: int
    before: Mapping[str, Objective] = field(default_factory=dict)
    helped: Mapping[str, str] = field(default_factory=dict)


@dataclass
class Turn:
    """One robot's turn or, if ``robot`` is None, the lines before the first turn.

    ``origin``, ``on_the_way`` (from an earlier turn) and ``progress`` are the robot's at the start
    of the turn, ``objectives`` those of the whole team. ``final``: only the outcome follows.
    ``torn``: the run was interrupted or the trace is truncated, so lines may be missing.
    ``failed``: a step has failed in this turn, or ended elsewhere than commanded. ``act``: the
    action that has ended in this turn.
    """

    tick: int
    robot: str | None
    line: int
    objectives: Mapping[str, Objective]
    origin: int | None = None
    on_the_way: bool = False
    progress: Progress | None = None
    records: list[Line] = field(default_factory=list)
    final: bool = False
    torn: bool = False
    failed: bool = False
    act: Line | None = None
    advanced: set[str] = field(default_factory=set)
    """Obstacles of which a need was met in this turn, as far as the moves imply it."""
    met: dict[tuple[str, int], frozenset[str]] = field(default_factory=dict)
    """The needs of obstacles that were met in this turn, with the robots that met them; for the
    last need of each, the robots that could have met it."""

    _kinds: dict[str, list[Line]] = field(default_factory=dict)

    def add(self, record: Line) -> None:
        """Add the next line of the turn."""
        self.records.append(record)
        self._kinds.setdefault(record.type, []).append(record)

    def all(self, kind: str) -> list[Line]:
        return [*self._kinds.get(kind, ())]

    def first(self, kind: str) -> Line | None:
        found = self._kinds.get(kind)
        return found[0] if found else None

    def is_refused(self, request: Line) -> bool:
        """Return whether a robot has no strategy for a request, as the next line states, if any."""
        after = next((line for line in self.records if line.line > request.line), None)
        if after is None:
            return self.torn
        return after.type == "synthesis" and after.verdict != "realizable"


def helpers_of(record: Line) -> tuple[str, ...]:
    """Return all helpers that a line names."""
    return record.helpers or (() if record.helper is None else (record.helper,))


def moment(record: Line) -> float:
    """Return the tick of a line; in a live run, its time in seconds."""
    return float(record.tick if record.t is None else record.t)


def is_over(wait: Line, record: Line) -> bool:
    """Return whether the waiting time of the team (line ``waiting``) has ended by the time of a
    line. The team then decides again, even without a change."""
    if wait.t is not None and record.t is None:
        return False  # an inserted move of a live run has the time of the next line
    return wait.until is not None and wait.until <= moment(record)


def is_of_user(record: Line) -> bool:
    """Return whether a line records an intervention by a user. In a live run a line of the operator
    precedes changes of a robot's service and objective."""
    by_user = getattr(record, "cause", None) == "user" or bool(getattr(record, "user", None))
    after = record.t is not None and record.type in ("service", "objective")
    return record.type == "operator" or (by_user and not after)


SCENARIO_CHANGES = ("gone", "appeared", "order", "objective", "service", "inputs")
"""Lines that record changes by the scenario."""


def is_of_scenario(record: Line) -> bool:
    """Return whether a line records a change by the scenario or the world, rather than by a user, a
    failure or a battery."""
    changes = record.type in SCENARIO_CHANGES and not fails(record)
    return changes and getattr(record, "cause", None) not in ("battery", "user")


def fails(record: Line) -> bool:
    """Return whether a robot fails, ends elsewhere than commanded, has an empty battery, or is
    charged again."""
    strays = record.type in ("move", "arrive") and record.result == "elsewhere"
    return strays or (record.type == "service" and record.cause in ("battery", "world"))


def taken(move: Line) -> set[int]:
    """Return the regions that a robot occupies after a move."""
    return {move.to} if move.toward is None else {move.to, move.toward}
