"""The robots of a run: poses at each tick, steps of several ticks, and batteries."""

from bisect import bisect_right
from collections.abc import Collection, Mapping

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.run.values import Changes, Look, RobotBelief, RobotProgress, looks
from safenav.scenario.model import Battery, Scenario
from safenav.scenario.objective import Objective
from safenav.world.map import HEADINGS, Heading, Region, RegionMap

SAME = 1e-3
"""Seconds within which two times are one instant."""


class ContradictionError(Exception):
    """A line that does not fit the header or the lines before it."""


class LongStep(Struct, frozen=True):
    """A step that takes several ticks: after ``first`` to ``last`` the robot is between its region
    and ``toward``, and occupies both; it arrives in the next tick. ``begin`` and ``end``: times of
    departure and arrival in ticks, or in seconds if the run has a clock."""

    first: int
    last: int
    toward: Region
    begin: float
    end: float

    def part(self, time: float) -> float:
        """Return the completed part of the step at a time, from 0 to 1."""
        return min(1.0, max(0.0, (time - self.begin) / max(self.end - self.begin, 1e-9)))


class Charge(Struct):
    """The charge of a robot's battery, and its region. ``since``: the time since when it has been
    standing, to which ``level`` applies; None during a step. Times are in ticks, or in seconds of
    a live run."""

    battery: Battery
    chargers: Collection[Region]
    region: Region
    level: float
    since: float | None = 0.0

    def at(self, now: float) -> float:
        if self.since is None:
            return self.level
        charging = self.region in self.chargers
        return self.battery.stayed(self.level, now - self.since, charging=charging)

    def percent(self, now: float) -> int:
        """Return the charge at a time, in percent of the capacity."""
        return round(100 * self.at(now) / self.battery.capacity)

    def leave(self, now: float) -> None:
        """Leave the region, in a step that it begins or is in."""
        self.level, self.since = self.at(now), None

    def come(self, region: Region, now: float) -> None:
        """End a step."""
        self.level, self.region, self.since = self.battery.stepped(self.level), region, now

    def put(self, region: Region, now: float) -> None:
        """Move it to the region into which an operator has put it."""
        if self.since is not None:
            self.level, self.region, self.since = self.at(now), region, now

    def replace(self, now: float) -> None:
        """Give it a full battery."""
        self.level, self.since = self.battery.capacity, None if self.since is None else now


class RobotTrack(Struct):
    """One robot and its history: ``regions[t]`` and ``headings[t]`` after tick t; ``vision``: its
    radius in regions, None if unlimited; ``steps``: those of more than one tick, in order;
    ``charge``: that of its battery, if it has one, in percent of its capacity."""

    name: str
    model: str
    layer: str
    capabilities: tuple[str, ...]
    look: Look
    regions: list[Region]
    headings: list[Heading | None]
    objectives: Changes[Objective | None]
    progress: Changes[RobotProgress] = field(default_factory=lambda: Changes.of(RobotProgress()))
    vision: float | None = None
    battery: Charge | None = None
    charge: Changes[int] | None = None
    steps: list[LongStep] = field(default_factory=list)
    beliefs: dict[str, Changes[RobotBelief | None]] = field(default_factory=dict)
    """Its knowledge about other robots, once it is recorded."""
    waits: list[Objective | None] = field(default_factory=list)
    """The objectives with which it has waited for help."""
    driven: bool = False
    """Whether a joint plan has moved it so far."""
    within: tuple[Region, Heading | None] | None = None
    """Its pose after its turn in the incomplete tick."""

    @property
    def pose(self) -> tuple[Region, Heading | None]:
        """The last pose, also within a tick."""
        return self.within or (self.regions[-1], self.headings[-1])

    def transit(self, tick: int) -> LongStep | None:
        """Return the step that the robot is in after ``tick``; None if it is in one region."""
        i = bisect_right(self.steps, tick, key=lambda step: step.first) - 1
        return self.steps[i] if i >= 0 and tick <= self.steps[i].last else None

    def stand(self, pose: tuple[Region, Heading | None] | None = None) -> None:
        """Add a tick, with the same pose or another one."""
        region, heading = pose or (self.regions[-1], self.headings[-1])
        self.regions.append(region)
        self.headings.append(heading)


class RobotPaths:
    """The paths up to the last line taken. ``seconds``: those of each instant of a live run; None
    for a run in lockstep, whose tick is complete when each robot has moved."""

    def __init__(
        self, world: RegionMap, tracks: Mapping[str, RobotTrack], seconds: list[float] | None
    ) -> None:
        self._map, self._tracks, self._seconds = world, tracks, seconds
        self._toward: dict[str, Region | None] = {}
        """Destinations of robots in transit that have had their turn in the incomplete tick."""

    def robot(self, name: str) -> RobotTrack:
        """Return the robot. Raises ContradictionError if the header does not name it."""
        if name not in self._tracks:
            raise ContradictionError(f"the header has no robot {name}")
        return self._tracks[name]

    def on_map(self, region: Region) -> Region:
        """Return the region. Raises ContradictionError if it is not on the map."""
        if not 0 <= region < self._map.size:
            last = self._map.size - 1
            raise ContradictionError(f"{region} is not a region of the map (0 to {last})")
        return region

    def instant(self, time: float | None) -> int:
        """Return the ordinal of an instant of a live run; at a new one all robots stay until a line
        moves them."""
        seconds = self._times()
        if time is not None and time > seconds[-1] + SAME:
            seconds.append(time)
            for track in self._tracks.values():
                track.stand()
                if track.steps and track.steps[-1].last == len(seconds) - 2:
                    track.steps[-1] = replace(track.steps[-1], last=len(seconds) - 1)
        return len(seconds) - 1

    def now(self, tick: int) -> float:
        """Return the time of a line: its tick, or the seconds of the last instant."""
        return tick if self._seconds is None else self._seconds[-1]

    def _times(self) -> list[float]:
        if self._seconds is None:
            raise ContradictionError("a run without a clock has no steps in seconds")
        return self._seconds

    def move(
        self, robot: str, tick: int, to: Region, heading: str | None, toward: Region | None
    ) -> None:
        """Take the next move of a robot. Raises ContradictionError for a move of another tick."""
        track = self.robot(robot)
        due = len(track.regions) + (robot in self._toward)
        if tick != due:
            expected = f"the next move of {robot} is that of tick {due}"
            raise ContradictionError(f"{expected}, not of tick {tick}")
        if robot in self._toward:
            other = next(name for name in self._tracks if name not in self._toward)
            raise ContradictionError(f"{other} has no move in tick {due - 1}")
        moves, track.within = to != track.regions[-1], (self.on_map(to), _facing(heading))
        if track.battery is not None and (moves or toward is not None):
            track.battery.leave(tick - 1)
        if track.battery is not None and moves:
            track.battery.come(to, tick)
        self._toward[robot] = None if toward is None else self.on_map(toward)
        if len(self._toward) == len(self._tracks):
            self._complete()

    def _complete(self) -> None:
        """Complete a tick; robots without a move stay, or remain in transit."""
        for name, track in self._tracks.items():
            tick = len(track.regions)
            before = track.transit(tick - 1)
            toward = self._toward.get(name, None if before is None else before.toward)
            track.stand(track.within)
            track.within = None
            if before is not None and before.toward == toward:
                track.steps[-1] = replace(before, last=tick, end=tick + 1)
            elif toward is not None:
                track.steps.append(LongStep(tick, tick, toward, tick - 1, tick + 1))
        self._toward.clear()

    def depart(self, robot: str, tick: int, to: Region, seconds: float | None) -> None:
        """Take the start of a step of a live run, and how long it probably takes."""
        now, track = self._times()[-1], self.robot(robot)
        track.steps.append(LongStep(tick, tick, self.on_map(to), now, now + (seconds or 0.0)))
        if track.battery is not None:
            track.battery.leave(now)

    def arrive(self, robot: str, tick: int, at: Region, heading: str | None) -> None:
        """Take the end of a step of a live run."""
        now, track = self._times()[-1], self.robot(robot)
        steps = track.steps
        if not steps or steps[-1].last < tick:
            raise ContradictionError(f"{robot} arrives without a departure")
        steps[-1] = replace(steps[-1], last=tick - 1, end=now)
        if steps[-1].last < steps[-1].first:
            del steps[-1]
        track.regions[-1], track.headings[-1] = self.on_map(at), _facing(heading)
        if track.battery is not None:
            track.battery.come(at, now)

    def put(self, robot: str, region: Region, heading: str | None) -> None:
        """Place a robot that an operator has put into a region."""
        track = self.robot(robot)
        track.regions[-1], track.headings[-1] = self.on_map(region), _facing(heading)
        if track.battery is not None:
            track.battery.put(region, self.now(len(track.regions) - 1))

    def end(self, tick: int) -> bool:
        """Return whether the run ended within a tick; robots without a turn in it then stay."""
        tracks = self._tracks.values()
        within = self._seconds is None and all(len(track.regions) == tick for track in tracks)
        if within:
            self._complete()
        return within


def tracks_of(scenario: Scenario) -> dict[str, RobotTrack]:
    found = {}
    style = looks([robot.name for robot in scenario.robots])
    for robot, look in zip(scenario.robots, style, strict=True):
        model, (region, heading) = robot.model, (robot.start.region, robot.start.heading)
        if model.vision is not None and model.vision < 1:
            raise ContradictionError(f"{robot.name} does not even see the next region")
        track = RobotTrack(
            robot.name,
            model.name,
            model.layer,
            tuple(sorted(robot.capabilities)),
            look,
            [region],
            [heading],
            Changes.of(robot.objective),
            vision=model.vision,
        )
        if model.battery is not None:
            own = Charge(model.battery, scenario.chargers, region, model.battery.start)
            track.battery, track.charge = own, Changes.of(own.percent(0.0))
        found[robot.name] = track
    return found


def _facing(heading: str | None) -> Heading | None:
    return None if heading is None else HEADINGS[heading]
