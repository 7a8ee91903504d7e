"""What happens in a run, as data. One class for each line type of the trace (docs/trace.md).

The story on the terminal, the trace file and library callers all see these same objects.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Any, ClassVar

from safenav.world.map import Region


class Reason(StrEnum):
    """Why a robot was synthesized."""

    INITIAL = "initial"
    REQUEST = "request"
    RESOLVED = "resolved"
    BLOCKED = "blocked"
    YIELD = "yield"


class BlockedBecause(StrEnum):
    """Why a hidden obstacle joined the known ones."""

    UNTRAVERSABLE = "untraversable"
    NO_CAPABLE_ROBOT = "no_capable_robot"
    NO_HELPER = "no_helper"


@dataclass(frozen=True)
class Event:
    """Base: ``tick`` is 0 before the first move. Field names are those of the trace, with a
    trailing underscore where Python has the word for itself."""

    type: ClassVar[str]
    tick: int

    def record(self) -> dict[str, Any]:
        """The event as one JSON object of the trace."""
        data: dict[str, Any] = {"type": self.type}
        for entry in fields(self):
            data[entry.name.rstrip("_")] = getattr(self, entry.name)
        return data


@dataclass(frozen=True)
class Header(Event):
    type: ClassVar[str] = "header"
    safenav: str
    scenario: dict[str, Any]

    def record(self) -> dict[str, Any]:
        return {
            "type": self.type,
            "trace": 1,
            "safenav": self.safenav,
            "scenario": self.scenario,
        }


@dataclass(frozen=True)
class Synthesized(Event):
    type: ClassVar[str] = "synthesis"
    robot: str
    reason: Reason
    verdict: str
    seconds: float
    states: int | None
    cached: bool
    verified: bool | None
    spec: str
    strategy: str | None
    objective: dict[str, Any]
    assumptions: list[str]


@dataclass(frozen=True)
class Moved(Event):
    type: ClassVar[str] = "move"
    robot: str
    from_: Region
    to: Region
    heading: str | None
    toward: Region | None = None

    def record(self) -> dict[str, Any]:
        data = super().record()
        if self.toward is None:
            del data["toward"]
        return data


@dataclass(frozen=True)
class Discovered(Event):
    """An obstacle that the scenario does not list; written as in the header."""

    type: ClassVar[str] = "discovered"
    obstacle: dict[str, Any]


@dataclass(frozen=True)
class Violated(Event):
    type: ClassVar[str] = "violation"
    robot: str
    at: Region
    proposed: Region
    obstacle: str
    action: str


@dataclass(frozen=True)
class Backtracked(Event):
    type: ClassVar[str] = "backtrack"
    robot: str
    to: Region


@dataclass(frozen=True)
class Requested(Event):
    type: ClassVar[str] = "request"
    obstacle: str
    requester: str
    bids: dict[str, int | None]
    helper: str | None
    regions: list[Region]


@dataclass(frozen=True)
class Pushed(Event):
    type: ClassVar[str] = "push"
    depth: int
    objectives: dict[str, dict[str, Any]]
    obstacle: str | None
    requester: str
    helper: str
    reason: Reason = Reason.REQUEST


@dataclass(frozen=True)
class Popped(Event):
    type: ClassVar[str] = "pop"
    depth: int
    objectives: dict[str, dict[str, Any]]
    obstacle: str | None
    requester: str
    helper: str
    reason: Reason = Reason.REQUEST


@dataclass(frozen=True)
class Resolved(Event):
    type: ClassVar[str] = "resolved"
    obstacle: str
    robot: str
    at: Region
    requested: bool
    traversable: bool | None


@dataclass(frozen=True)
class Blocked(Event):
    type: ClassVar[str] = "blocked"
    obstacle: str
    robots: list[str]
    reason: BlockedBecause


@dataclass(frozen=True)
class GoalReached(Event):
    type: ClassVar[str] = "goal"
    robot: str
    goal: int
    region: Region
    round: int


@dataclass(frozen=True)
class Believed(Event):
    type: ClassVar[str] = "belief"
    robot: str
    of: str
    seen: bool
    regions: list[Region]


@dataclass(frozen=True)
class AssumptionViolated(Event):
    type: ClassVar[str] = "assumption"
    robot: str
    name: str


@dataclass(frozen=True)
class Ended(Event):
    type: ClassVar[str] = "outcome"
    outcome: str
    explanation: str
    rounds: dict[str, int]
    ticks: int
    seconds: float
    syntheses: int
    synthesis_seconds: float
    cause: str | None = None

    def record(self) -> dict[str, Any]:
        data = super().record()
        if self.cause is None:
            del data["cause"]
        return data
