"""The lines of a trace as typed data (docs/trace.md, version 1).

One frozen dataclass a line type. ``line`` is the number of the line in the file, from 1, so
that whoever finds fault with a line can point at it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

Region = int
Heading = str
"""``north``, ``east``, ``south`` or ``west``."""

TRACE_VERSIONS = (1, 2)


class Verdict(StrEnum):
    REALIZABLE = "realizable"
    UNREALIZABLE = "unrealizable"
    TIMEOUT = "timeout"
    OUT_OF_MEMORY = "out_of_memory"


class SynthesisReason(StrEnum):
    INITIAL = "initial"
    REQUEST = "request"
    RESOLVED = "resolved"
    BLOCKED = "blocked"
    YIELD = "yield"


class BlockReason(StrEnum):
    UNTRAVERSABLE = "untraversable"
    NO_CAPABLE_ROBOT = "no_capable_robot"
    NO_HELPER = "no_helper"


class Ending(StrEnum):
    COMPLETED = "completed"
    OPERATOR_NEEDED = "operator_needed"
    UNREALIZABLE = "unrealizable"
    TICK_LIMIT = "tick_limit"
    ASSUMPTION_VIOLATED = "assumption_violated"
    INTERRUPTED = "interrupted"
    ERROR = "error"


class OperatorCause(StrEnum):
    NO_CAPABLE_ROBOT = "no_capable_robot"
    CYCLIC_REQUESTS = "cyclic_requests"
    UNREALIZABLE = "unrealizable"
    DEADLOCK = "deadlock"


@dataclass(frozen=True)
class Objective:
    """What a robot is asked to do, over and over.

    ``targets``: regions of which any counts, in the objective's own order; none for ``ltl``.
    ``text`` is the objective in one spelling, so that equal objectives are equal data.
    """

    kind: str
    targets: tuple[frozenset[Region], ...]
    text: str

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class RobotHeader:
    name: str
    model: str
    mobility: str
    layer: str
    capabilities: frozenset[str]
    start: Region
    heading: Heading | None
    objective: Objective
    conflicts: frozenset[str] | None = None
    """Those it must not share a region with; None: those of its layer."""
    vision: float | None = None
    """How far it sees, in regions; None: without limit, or the trace does not say."""
    motion: Mapping[str, object] | None = None
    """How it moves in metres: ``kind`` and parameters; None: the trace does not say."""


@dataclass(frozen=True)
class ObstacleHeader:
    """A hidden obstacle; ``blocks`` as written, ``traversable`` is the truth of this run.
    ``line`` is where it is announced: in the header, or where it was discovered."""

    name: str
    type: str
    region: Region
    action: str
    resolution_regions: tuple[Region, ...]
    blocks: frozenset[str]
    traversable: bool | None
    line: int = 1


@dataclass(frozen=True)
class Header:
    """The first line. ``robots`` are in the order of their turns; ``obstacles`` include those
    that were discovered later. ``external``: the world was not simulated, so that obstacles are
    suspected only, nobody knows their truth, and actions may fail. A limit that the header
    does not give is None, and so are ``resolution`` (metres that a region measures along x and
    y) and ``origin`` (x, y and yaw of the south-western corner)."""

    line: int
    safenav: str
    name: str
    rows: int
    cols: int
    grid: tuple[str, ...]
    robots: Mapping[str, RobotHeader]
    obstacles: Mapping[str, ObstacleHeader]
    until_rounds: int | None
    limit_ticks: int | None
    seed: int
    coordination: str
    resolution: tuple[float, float] | None = None
    origin: tuple[float, float, float] | None = None
    external: bool = False


@dataclass(frozen=True)
class Line:
    """What every line but the header has."""

    line: int
    tick: int


@dataclass(frozen=True)
class Synthesis(Line):
    robot: str
    reason: SynthesisReason
    verdict: Verdict
    seconds: float
    states: int | None
    cached: bool
    verified: bool | None
    spec: str
    strategy: str | None
    objective: Objective
    assumptions: tuple[str, ...]


@dataclass(frozen=True)
class Move(Line):
    """``toward``: the robot is on its way there and takes up that region, too."""

    robot: str
    origin: Region
    to: Region
    heading: Heading | None
    toward: Region | None = None


@dataclass(frozen=True)
class Violation(Line):
    robot: str
    at: Region
    proposed: Region
    obstacle: str
    action: str


@dataclass(frozen=True)
class Backtrack(Line):
    robot: str
    to: Region


@dataclass(frozen=True)
class Request(Line):
    obstacle: str
    requester: str
    bids: Mapping[str, int | None]
    helper: str | None
    regions: tuple[Region, ...]


@dataclass(frozen=True)
class Push(Line):
    """``obstacle`` and ``helper`` are None where a robot was asked to make way."""

    depth: int
    objectives: Mapping[str, Objective]
    obstacle: str | None
    requester: str | None
    helper: str | None


@dataclass(frozen=True)
class Pop(Line):
    depth: int
    objectives: Mapping[str, Objective]
    obstacle: str | None
    requester: str | None
    helper: str | None


@dataclass(frozen=True)
class Discovered(Line):
    obstacle: ObstacleHeader


@dataclass(frozen=True)
class Resolved(Line):
    obstacle: str
    robot: str
    at: Region
    requested: bool
    traversable: bool | None


@dataclass(frozen=True)
class Blocked(Line):
    obstacle: str
    robots: frozenset[str]
    reason: BlockReason


@dataclass(frozen=True)
class Goal(Line):
    robot: str
    goal: int
    region: Region
    round: int


@dataclass(frozen=True)
class Belief(Line):
    """``robot`` sees ``of`` in the only one of ``regions``, or believes it to be in any."""

    robot: str
    of: str
    seen: bool
    regions: frozenset[Region]


@dataclass(frozen=True)
class Assumption(Line):
    robot: str
    name: str


@dataclass(frozen=True)
class Outcome(Line):
    outcome: Ending
    explanation: str
    rounds: Mapping[str, int]
    ticks: int
    seconds: float
    syntheses: int
    synthesis_seconds: float
    cause: OperatorCause | None


Record = (
    Synthesis
    | Move
    | Violation
    | Backtrack
    | Request
    | Push
    | Pop
    | Discovered
    | Resolved
    | Blocked
    | Goal
    | Belief
    | Assumption
    | Outcome
)


@dataclass(frozen=True)
class Trace:
    """A whole trace. ``cut_off``: its last line was incomplete (the writer was killed).

    ``ignored`` counts the lines of types that this version does not know.
    """

    source: str
    header: Header
    records: tuple[Record, ...]
    cut_off: bool
    ignored: int

    @property
    def outcome(self) -> Outcome | None:
        """How the run ended, or None if the trace does not say."""
        for record in reversed(self.records):
            if isinstance(record, Outcome):
                return record
        return None
