"""The paths of robots in a replay: where each was after each tick, and its longer steps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from msgspec.structs import replace

from safenav.report.replay.timeline import LongStep, RobotTrack
from safenav.trace import records, setting
from safenav.world.map import HEADINGS, Region, RegionMap

SAME = 1e-3
"""Seconds within which two instants are the same."""


class ContradictionError(Exception):
    """A line that does not fit the header or the lines before it."""


class RobotPaths:
    """The paths as far as the lines tell. ``times``: seconds of each instant of a live run; None
    for a run in lockstep, which has ticks."""

    def __init__(self, world: RegionMap, robots: Mapping[str, setting.RobotHeader], *, live: bool):
        self.map = world
        self.tracks = {name: self._track(name, robot) for name, robot in robots.items()}
        self.regions = {name: list(track.regions) for name, track in self.tracks.items()}
        self.headings = {name: list(track.headings) for name, track in self.tracks.items()}
        self.times = [0.0] if live else None
        self._steps: dict[str, list[LongStep]] = {name: [] for name in robots}  # of a live run
        self._toward: dict[str, list[Region | None]] = {name: [None] for name in robots}

    def _track(self, name: str, robot: setting.RobotHeader) -> RobotTrack:
        heading = HEADINGS[robot.heading] if robot.heading is not None else None
        can = tuple(sorted(robot.capabilities))
        if robot.vision is not None and robot.vision < 1:
            raise ContradictionError(f"{name} does not even see the next region")
        place = ((self.on_map(robot.start),), (heading,))
        return RobotTrack(name, robot.model, robot.layer, can, *place, robot.vision)

    def known(self, robot: str) -> None:
        """Raises ContradictionError for a robot that the header does not name."""
        if robot not in self.tracks:
            raise ContradictionError(f"the header has no robot {robot}")

    def on_map(self, region: Region) -> Region:
        """Return the region. Raises ContradictionError if it is not on the map."""
        if not 0 <= region < self.map.size:
            raise ContradictionError(
                f"{region} is not a region of the map (0 to {self.map.size - 1})"
            )
        return region

    @property
    def last(self) -> int:
        """The last tick that is complete."""
        return min((len(regions) for regions in self.regions.values()), default=1) - 1

    def timed(self, line: records.Record) -> records.Record:
        """Return the line with the number of its instant, if the run has a clock; until then all is
        as it was."""
        times = self.times
        if times is None:
            return line
        if line.t is not None and line.t > times[-1] + SAME:
            times.append(line.t)
            for name in self.tracks:
                self.regions[name].append(self.regions[name][-1])
                self.headings[name].append(self.headings[name][-1])
                steps = self._steps[name]
                if steps and steps[-1].last == len(times) - 2:
                    steps[-1] = replace(steps[-1], last=len(times) - 1)
        return replace(line, tick=len(times) - 1)

    def move(self, line: records.Move) -> None:
        """Take the move of a robot in the tick after its last."""
        self.known(line.robot)
        regions, headings = self.regions[line.robot], self.headings[line.robot]
        if line.tick != len(regions):
            expected = f"the next move of {line.robot} is that of tick {len(regions)}"
            raise ContradictionError(f"{expected}, not of tick {line.tick}")
        regions.append(self.on_map(line.to))
        headings.append(HEADINGS[line.heading] if line.heading is not None else None)
        toward = None if line.toward is None else self.on_map(line.toward)
        self._toward[line.robot].append(toward)

    def step(self, line: records.Depart | records.Arrive) -> None:
        """Take the beginning of a step of a live run, or its end."""
        self.known(line.robot)
        if self.times is None:
            raise ContradictionError("a run without a clock has no steps in seconds")
        now, steps = self.times[-1], self._steps[line.robot]
        if isinstance(line, records.Depart):
            end = now + (line.seconds or 0.0)
            steps.append(LongStep(line.tick, line.tick, self.on_map(line.to), now, end))
            return
        if not steps or steps[-1].last < line.tick:
            raise ContradictionError(f"{line.robot} arrives, and is not under way")
        steps[-1] = replace(steps[-1], last=line.tick - 1, end=now)
        if steps[-1].last < steps[-1].first:
            del steps[-1]
        self.regions[line.robot][-1] = self.on_map(line.at)
        self.headings[line.robot][-1] = None if line.heading is None else HEADINGS[line.heading]

    def stand(self) -> None:
        """Let robots that took no turn in the tick after the last complete one stand where they
        were."""
        last = self.last
        for name, regions in self.regions.items():
            if len(regions) == last + 1:
                regions.append(regions[-1])
                self.headings[name].append(self.headings[name][-1])
                self._toward[name].append(self._toward[name][-1])

    def up_to(self, last: int) -> tuple[RobotTrack, ...]:
        """Return each robot's track up to a tick."""
        return tuple(
            replace(
                track,
                regions=tuple(self.regions[name][: last + 1]),
                headings=tuple(self.headings[name][: last + 1]),
                steps=self.steps(name, last),
            )
            for name, track in self.tracks.items()
        )

    def steps(self, robot: str, last: int) -> tuple[LongStep, ...]:
        """Return the steps of a robot that took longer than a tick, up to the tick ``last``."""
        if self.times is not None:
            return tuple(self._steps[robot])
        return _long_steps(self._toward[robot][: last + 1])


def _long_steps(bound: Sequence[Region | None]) -> tuple[LongStep, ...]:
    """Return the runs of ticks in which a robot is in transit to the same region."""
    steps: list[LongStep] = []
    for tick, toward in enumerate(bound):
        if toward is None:
            continue
        before = steps[-1] if steps else None
        if before is not None and before.last == tick - 1 and before.toward == toward:
            steps[-1] = replace(before, last=tick, end=tick + 1)
        else:
            steps.append(LongStep(tick, tick, toward, tick - 1, tick + 1))
    return tuple(steps)
