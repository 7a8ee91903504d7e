"""The robots of a run: their poses at each tick, steps of several ticks, and batteries."""

from bisect import bisect_right

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.run.values import Changes, Look, RobotBelief, RobotProgress, looks
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Objective
from safenav.world.map import HEADINGS, Heading, Region

SAME = 1e-3
"""Maximum difference in seconds of two times of one instant."""


class ContradictionError(Exception):
    """A contradiction between a line and the header or earlier lines."""


class LongStep(Struct, frozen=True):
    """A step of several ticks. After ticks ``first`` to ``last`` the robot is between its region
    and ``toward`` and occupies both; it arrives in the next tick. ``begin`` and ``end``: times of
    departure and arrival in ticks, or in seconds if the run has a clock."""

    first: int
    last: int
    toward: Region
    begin: float
    end: float

    def part(self, time: float) -> float:
        """Return the completed fraction of the step at a time, from 0 to 1."""
        return min(1.0, max(0.0, (time - self.begin) / max(self.end - self.begin, 1e-9)))


class RobotTrack(Struct):
    """A robot and its history. ``regions[t]`` and ``headings[t]``: its pose after tick t, or after
    its turn in an incomplete tick. ``steps``: the steps of several ticks, in order; ``charge``: its
    charge, in percent of the capacity; empty if it has no battery."""

    name: str
    model: str
    capabilities: tuple[str, ...]
    look: Look
    regions: list[Region]
    headings: list[Heading | None]
    objectives: Changes[Objective | None]
    progress: Changes[RobotProgress] = field(default_factory=lambda: Changes.of(RobotProgress()))
    charge: Changes[int] = field(default_factory=Changes)
    out: Changes[bool] = field(default_factory=lambda: Changes.of(False))
    """Whether it is out of service."""
    steps: list[LongStep] = field(default_factory=list)
    beliefs: dict[str, Changes[RobotBelief | None]] = field(default_factory=dict)
    """Its knowledge of other robots, once recorded."""

    @property
    def pose(self) -> tuple[Region, Heading | None]:
        """The robot's last pose, even in an incomplete tick."""
        return self.regions[-1], self.headings[-1]

    def transit(self, tick: int) -> LongStep | None:
        """Return the step under way after ``tick``; None if the robot occupies one region."""
        i = bisect_right(self.steps, tick, key=lambda step: step.first) - 1
        return self.steps[i] if i >= 0 and tick <= self.steps[i].last else None

    def stand(self) -> None:
        """Add a tick in which the robot keeps its pose or continues its step."""
        tick = len(self.regions)
        self.regions.append(self.regions[-1])
        self.headings.append(self.headings[-1])
        if self.transit(tick - 1) is not None:
            self.steps[-1] = replace(self.steps[-1], last=tick)

    def move(self, to: Region, heading: str | None, toward: Region | None) -> None:
        """Add a tick after which the robot is in a region, or in transit ``toward`` another one."""
        tick = len(self.regions)
        before = self.transit(tick - 1)
        self.regions.append(to)
        self.headings.append(_facing(heading))
        if before is not None and before.toward == toward:
            self.steps[-1] = replace(before, last=tick, end=tick + 1)
        elif toward is not None:
            self.steps.append(LongStep(tick, tick, toward, tick - 1, tick + 1))

    def depart(self, tick: int, to: Region, now: float, seconds: float) -> None:
        """Begin a step of a live run, with its expected duration in seconds."""
        self.steps.append(LongStep(tick, tick, to, now, now + seconds))

    def arrive(self, tick: int, at: Region, heading: str | None, now: float) -> None:
        """End a step of a live run."""
        if not self.steps or self.steps[-1].last < tick:
            raise ContradictionError(f"{self.name} arrives without a departure")
        step = self.steps.pop()
        if step.first < tick:
            self.steps.append(replace(step, last=tick - 1, end=now))
        self.put(at, heading)

    def put(self, region: Region, heading: str | None) -> None:
        """Place the robot in a region."""
        self.regions[-1], self.headings[-1] = region, _facing(heading)


def tracks_of(scenario: Scenario) -> dict[str, RobotTrack]:
    found = {}
    style = looks([robot.name for robot in scenario.robots])
    for robot, look in zip(scenario.robots, style, strict=True):
        model, (region, heading) = robot.model, (robot.start.region, robot.start.heading)
        track = RobotTrack(
            robot.name,
            model.name,
            tuple(sorted(robot.capabilities)),
            look,
            [region],
            [heading],
            Changes.of(robot.objective),
        )
        if model.battery is not None:
            track.charge = Changes.of(model.battery.percent(model.battery.start))
        found[robot.name] = track
    return found


def _facing(heading: str | None) -> Heading | None:
    return None if heading is None else HEADINGS[heading]
