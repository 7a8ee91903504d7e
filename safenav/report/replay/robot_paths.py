"""The paths of robots in a replay: the pose after each tick, and steps of several ticks."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec.structs import replace

from safenav.report.replay.timeline import LongStep, RobotTrack
from safenav.trace import records, setting
from safenav.world.map import HEADINGS, Region, RegionMap

SAME = 1e-3
"""Seconds within which two times are one instant."""


class ContradictionError(Exception):
    """A line that does not fit the header or the lines before it."""


class RobotPaths:
    """The paths up to the last line taken. ``times``: seconds of each instant of a live run; None
    for a run in lockstep, whose tick is complete when each robot has moved."""

    def __init__(self, world: RegionMap, robots: Mapping[str, setting.RobotHeader], *, live: bool):
        self.map = world
        self.tracks = {name: self._track(name, robot) for name, robot in robots.items()}
        self.times = [0.0] if live else None
        self._moves: dict[str, records.Move] = {}  # of the incomplete tick

    def _track(self, name: str, robot: setting.RobotHeader) -> RobotTrack:
        heading = HEADINGS[robot.heading] if robot.heading is not None else None
        can = tuple(sorted(robot.capabilities))
        if robot.vision is not None and robot.vision < 1:
            raise ContradictionError(f"{name} does not even see the next region")
        place = ([self.on_map(robot.start)], [heading])
        return RobotTrack(name, robot.model, robot.layer, can, *place, robot.vision)

    def known(self, robot: str) -> RobotTrack:
        """Return the robot. Raises ContradictionError if the header does not name it."""
        if robot not in self.tracks:
            raise ContradictionError(f"the header has no robot {robot}")
        return self.tracks[robot]

    def on_map(self, region: Region) -> Region:
        """Return the region. Raises ContradictionError if it is not on the map."""
        if not 0 <= region < self.map.size:
            raise ContradictionError(
                f"{region} is not a region of the map (0 to {self.map.size - 1})"
            )
        return region

    def timed(self, line: records.Record) -> records.Record:
        """Return the line with its instant as the tick if the run has a clock; at a new instant
        all robots stay until a line moves them."""
        times = self.times
        if times is None:
            return line
        if line.t is not None and line.t > times[-1] + SAME:
            times.append(line.t)
            for track in self.tracks.values():
                _stand(track)
                if track.steps and track.steps[-1].last == len(times) - 2:
                    track.steps[-1] = replace(track.steps[-1], last=len(times) - 1)
        return replace(line, tick=len(times) - 1)

    def move(self, line: records.Move) -> None:
        """Take the next move of a robot. Raises ContradictionError for a move of another tick."""
        due = len(self.known(line.robot).regions) + (line.robot in self._moves)
        if line.tick != due:
            expected = f"the next move of {line.robot} is that of tick {due}"
            raise ContradictionError(f"{expected}, not of tick {line.tick}")
        if line.robot in self._moves:
            other = next(name for name in self.tracks if name not in self._moves)
            raise ContradictionError(f"{other} has no move in tick {due - 1}")
        for region in (line.to, line.toward):
            if region is not None:
                self.on_map(region)
        self._moves[line.robot] = line
        if len(self._moves) == len(self.tracks):
            self._complete()

    def _complete(self) -> None:
        """Complete a tick; robots without a move stay, or remain in transit."""
        for name, track in self.tracks.items():
            tick, move = len(track.regions), self._moves.get(name)
            before = track.transit(tick - 1)
            if move is None:
                _stand(track)
                toward = None if before is None else before.toward
            else:
                track.regions.append(move.to)
                track.headings.append(None if move.heading is None else HEADINGS[move.heading])
                toward = move.toward
            if before is not None and before.toward == toward:
                track.steps[-1] = replace(before, last=tick, end=tick + 1)
            elif toward is not None:
                track.steps.append(LongStep(tick, tick, toward, tick - 1, tick + 1))
        self._moves.clear()

    def end(self, tick: int) -> bool:
        """Return whether the run ended within a tick; robots without a turn in it then stay."""
        within = self.times is None and all(
            len(track.regions) == tick for track in self.tracks.values()
        )
        if within:
            self._complete()
        return within

    def step(self, line: records.Depart | records.Arrive) -> None:
        """Take the start or the end of a step of a live run."""
        track = self.known(line.robot)
        if self.times is None:
            raise ContradictionError("a run without a clock has no steps in seconds")
        now, steps = self.times[-1], track.steps
        if isinstance(line, records.Depart):
            end = now + (line.seconds or 0.0)
            steps.append(LongStep(line.tick, line.tick, self.on_map(line.to), now, end))
            return
        if not steps or steps[-1].last < line.tick:
            raise ContradictionError(f"{line.robot} arrives, and is not under way")
        steps[-1] = replace(steps[-1], last=line.tick - 1, end=now)
        if steps[-1].last < steps[-1].first:
            del steps[-1]
        track.regions[-1] = self.on_map(line.at)
        track.headings[-1] = None if line.heading is None else HEADINGS[line.heading]


def _stand(track: RobotTrack) -> None:
    track.regions.append(track.regions[-1])
    track.headings.append(track.headings[-1])
