"""Settings of a scenario: coordination, clock, failures, limits, inputs, expectations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import Annotated, ClassVar

from msgspec import Struct

from safenav.data import Count
from safenav.errors import Outcome
from safenav.scenario.objective import Objective
from safenav.scenario.yaml.typed import Key
from safenav.world.map import Region


class RobotChange(Struct, frozen=True):
    """A change for a robot during the run, at the beginning of tick ``at``: either a new
    ``objective`` (its rounds ``within`` this many ticks) or whether it is in service (``active``);
    the other is None."""

    at: Count
    robot: str
    objective: Objective | None = None
    active: bool | None = None
    within: Count | None = None


class Input(Struct, frozen=True):
    """A Boolean that the environment sets, the same for all robots in a tick; off before the first.
    A simulation turns it on in the ticks of ``spans`` (first and last). ``again``: the values that
    specifications assume infinitely often."""

    name: str
    spans: tuple[tuple[Count, Count], ...] = ()
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
    """Reactions to robots that fail to carry out a command in a live run.

    A command that has not ended after its time limit is cancelled; if it has not ended after the
    same time again, the robot is lost."""

    example: ClassVar[str] = "{retries: 3}"
    retries: Annotated[int, Key("Number of retries of a failed move into a region.")] = 2
    then: Annotated[
        FailedMoves, Key("Then the region is an obstacle, or the robot is out of service.")
    ] = FailedMoves.OBSTACLE
    most: Annotated[
        int, Key("Failed moves in a row after which a robot is out of service.", least=1)
    ] = 6
    actions: Annotated[int, Key("Failed actions after which another robot helps.", least=1)] = 2
    patience: Annotated[
        float, Key("Median durations after which a command is cancelled.", above=0)
    ] = 10.0
    timeout: Annotated[
        float | None, Key("Seconds after which a command is cancelled. Default: none.", above=0)
    ] = None


class LatePolicy(StrEnum):
    """Policy after a missed deadline: the run continues, or ends with the outcome ``late``."""

    GO_ON = "go_on"
    STOP = "stop"


class Until(Struct, frozen=True):
    """When a run is completed."""

    example: ClassVar[str] = "{rounds: 2}"
    rounds: Annotated[int, Key("Rounds of each robot after the last resolution.", least=1)] = 2
    by: Annotated[
        int | None, Key("The latest tick at which the mission is completed.", least=1)
    ] = None


class Limits(Struct, frozen=True):
    """Limits of the run and of each synthesis."""

    example: ClassVar[str] = "{ticks: 500}"
    elsewhere: ClassVar[Mapping[str, str]] = {
        "states": "limit a synthesis by 'synthesis_seconds' and 'synthesis_memory'"
    }
    ticks: Annotated[int, Key("Ticks of a run.", least=1)] = 1000
    synthesis_seconds: Annotated[float, Key("Seconds of a single synthesis.", above=0)] = 60.0
    synthesis_memory: Annotated[int, Key("Memory of a single synthesis, in MiB.", least=1)] = 2048
    seconds: Annotated[
        float | None, Key("Seconds of a run (live: on its clock). Default: none.", above=0)
    ] = None


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
