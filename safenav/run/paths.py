"""The paths of the robots of a run: poses at each tick, and steps of several ticks."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from msgspec import Struct
from msgspec.structs import replace

from safenav.run.values import LongStep, RobotTrack
from safenav.scenario.model import Battery, Robot
from safenav.world.map import HEADINGS, Heading, Region, RegionMap

SAME = 1e-3
"""Seconds within which two times are one instant."""


class ContradictionError(Exception):
    """A line that does not fit the header or the lines before it."""


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
        track.within = (self.on_map(to), facing(heading))
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
        now = self._times()[-1]
        step = LongStep(tick, tick, self.on_map(to), now, now + (seconds or 0.0))
        self.robot(robot).steps.append(step)

    def arrive(self, robot: str, tick: int, at: Region, heading: str | None) -> None:
        """Take the end of a step of a live run."""
        now, track = self._times()[-1], self.robot(robot)
        steps = track.steps
        if not steps or steps[-1].last < tick:
            raise ContradictionError(f"{robot} arrives, and is not under way")
        steps[-1] = replace(steps[-1], last=tick - 1, end=now)
        if steps[-1].last < steps[-1].first:
            del steps[-1]
        track.regions[-1], track.headings[-1] = self.on_map(at), facing(heading)

    def put(self, robot: str, region: Region, heading: str | None) -> None:
        """Place a robot that an operator has put into a region."""
        track = self.robot(robot)
        track.regions[-1], track.headings[-1] = self.on_map(region), facing(heading)

    def end(self, tick: int) -> bool:
        """Return whether the run ended within a tick; robots without a turn in it then stay."""
        tracks = self._tracks.values()
        within = self._seconds is None and all(len(track.regions) == tick for track in tracks)
        if within:
            self._complete()
        return within


def facing(heading: str | None) -> Heading | None:
    return None if heading is None else HEADINGS[heading]


class Charge(Struct):
    """The charge of a robot's battery, and its region. ``since``: the time since when it has been
    standing, to which ``charge`` applies; None during a step. Times are in ticks, or in seconds of
    a live run."""

    battery: Battery
    charge: float
    region: Region
    since: float | None = 0.0

    def at(self, now: float, chargers: Collection[Region]) -> float:
        if self.since is None:
            return self.charge
        charging = self.region in chargers
        return self.battery.stayed(self.charge, now - self.since, charging=charging)


class Charges(dict[str, Charge]):
    """The charges of the robots with a battery. Methods ignore other robots."""

    def __init__(self, robots: Iterable[Robot], chargers: Collection[Region]) -> None:
        for robot in robots:
            if (battery := robot.model.battery) is not None:
                self[robot.name] = Charge(battery, battery.start, robot.start.region)
        self._chargers = chargers

    def percent(self, robot: str, now: float) -> int:
        """Return the charge of a robot at a time, in percent of its capacity."""
        return round(100 * self[robot].at(now, self._chargers) / self[robot].battery.capacity)

    def lowest(self, region: Region, now: float) -> str | None:
        """Return the robot in a region with the least charge; None if there is none."""
        here = [name for name, own in self.items() if own.region == region]
        return min(here, key=lambda name: self[name].at(now, self._chargers), default=None)

    def left(self, robot: str, now: float) -> None:
        """A robot begins a step, or is in one."""
        if (own := self.get(robot)) is not None:
            own.charge, own.since = own.at(now, self._chargers), None

    def came(self, robot: str, region: Region, now: float) -> None:
        """A robot ends a step."""
        if (own := self.get(robot)) is not None:
            own.charge = own.battery.stepped(own.charge)
            own.region, own.since = region, now

    def placed(self, robot: str, region: Region, now: float) -> None:
        """A standing robot was put into a region by an operator."""
        if (own := self.get(robot)) is not None and own.since is not None:
            own.charge, own.region, own.since = own.at(now, self._chargers), region, now

    def replaced(self, robot: str, now: float) -> None:
        """A robot has a full battery."""
        own = self[robot]
        own.charge, own.since = own.battery.capacity, None if own.since is None else now
