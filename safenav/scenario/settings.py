"""Settings of a scenario: coordination, clock, failures, limits, inputs, expectations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import StrEnum

from msgspec import Struct

from safenav.outcome import Outcome
from safenav.scenario.objective import Objective
from safenav.world.map import Region


class RobotChange(Struct, frozen=True):
    """A change for a robot during the run, at the beginning of tick ``at``: either a new
    ``objective`` (its rounds ``within`` this many ticks) or whether it is in service (``active``);
    the other is None."""

    at: int
    robot: str
    objective: Objective | None = None
    active: bool | None = None
    within: int | None = None


class Input(Struct, frozen=True):
    """A Boolean that the environment sets, the same for all robots in a tick; off before the first.
    A simulation turns it on in the ticks of ``spans`` (first and last). ``again``: the values that
    specifications assume infinitely often."""

    name: str
    spans: tuple[tuple[int, int], ...] = ()
    again: tuple[bool, ...] = ()

    def is_on(self, tick: int) -> bool:
        """Return whether a simulation has it on in a tick."""
        return any(first <= tick <= last for first, last in self.spans)


def switching(inputs: Iterable[Input]) -> list[int]:
    """Return the ticks, ascending, in which inputs change."""
    found = set[int]()
    for each in inputs:
        edges = {tick for first, last in each.spans for tick in (first, last + 1)}
        found |= {tick for tick in edges if each.is_on(tick) != each.is_on(tick - 1)}
    return sorted(found)


class Exclusion(Struct, frozen=True):
    """``robots`` of which at most one is in ``regions`` at any moment; one in transit is in both of
    its regions."""

    robots: frozenset[str]
    regions: frozenset[Region]


class Coordination(StrEnum):
    """Method by which the coordination layer reassigns robots (docs/coordination.md)."""

    RESYNTHESIS = "resynthesis"
    ASSIGNABLE = "assignable"


class Clock(StrEnum):
    """Time of a run: in ticks, in each of which every robot takes its turn, or in seconds
    (``live``): each robot decides when its last command has ended."""

    LOCKSTEP = "lockstep"
    LIVE = "live"


class FailedMoves(StrEnum):
    """Policy after too many failed moves of a robot into a region: the region counts as an obstacle
    that only an operator resolves, or the robot is out of service."""

    OBSTACLE = "obstacle"
    OUT_OF_SERVICE = "out_of_service"


class Failures(Struct, frozen=True):
    """Policies of a live run. ``retries``: repetitions of a failed move into a region before
    ``then``. ``most``: failed moves without an arrival after which a robot is out of service.
    ``actions``: failed actions of a robot on an obstacle after which another robot helps.
    A step is cancelled after ``patience`` times the median duration, a command after ``timeout``
    seconds (None: no such limit); if it has not ended after the same time again, the robot is
    lost."""

    retries: int = 2
    then: FailedMoves = FailedMoves.OBSTACLE
    most: int = 6
    actions: int = 2
    patience: float = 10.0
    timeout: float | None = None


class LatePolicy(StrEnum):
    """Policy after a missed deadline: the run continues, or ends with the outcome ``late``."""

    GO_ON = "go_on"
    STOP = "stop"


class Until(Struct, frozen=True):
    """The run is completed when every robot has met its objective this many times after the
    last resolution; ``by``: the tick of its deadline, None if it has none."""

    rounds: int = 2
    by: int | None = None


class Limits(Struct, frozen=True):
    """Limits of a run in ``ticks`` and ``seconds`` (wall time, or the clock of a live run; None: no
    limit), and of each synthesis in seconds (wall time) and MiB."""

    ticks: int = 1000
    synthesis_seconds: float = 60.0
    synthesis_memory: int = 2048
    seconds: float | None = None


class Expect(Struct, frozen=True):
    """The expected result of a run of the scenario; None means: not checked.

    ``resolved`` and ``blocked`` name obstacles (``door@47``) as sets; ``helpers`` maps an
    obstacle to its helper; ``ticks`` is an upper bound; ``rounds``: the least number of each robot;
    ``late``: the robots, obstacles and ``mission`` that miss a deadline, as a set.
    """

    outcome: Outcome | None = None
    resolved: frozenset[str] | None = None
    blocked: frozenset[str] | None = None
    helpers: Mapping[str, str] | None = None
    ticks: int | None = None
    rounds: Mapping[str, int] | None = None
    late: frozenset[str] | None = None


DEFAULT_CLOCK = Clock.LOCKSTEP
"""The clock of a scenario that names none."""
