"""The actual world of a scenario in seconds: durations of commands follow the robots' motion, or
the timing of their models. Time passes in ``wait`` only."""

from __future__ import annotations

import heapq
import random
from collections.abc import Collection, Mapping, Sequence
from itertools import count

from msgspec.structs import replace

from safenav.pace.robot import SIDE, Pace, acted_by, pace_of
from safenav.runtime.worlds.protocol import Acted, Arrived, Blocked, Change, Ended, WorldEvent
from safenav.runtime.worlds.truth import SimulatedWorld
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.motion import resolved
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region, RegionMap
from safenav.world.moves import Pose

Works = list[tuple[Obstacle, tuple[str, ...]]]
"""Obstacles on which robots act, each with these robots."""


class LiveSimulation:
    """``truth``: its hidden obstacles. ``speeds``: factors of the robots' speeds; a share
    ``delayed`` of the steps, drawn from ``seed`` (default: the scenario's), takes ``factor`` times
    as long. ``paces_of``: durations, default those of the robots' motion."""

    def __init__(
        self,
        scenario: Scenario,
        *,
        speeds: Mapping[str, float] | None = None,
        delayed: float = 0.0,
        factor: float = 5.0,
        seed: int | None = None,
        paces_of: Mapping[str, Pace] | None = None,
    ) -> None:
        self.truth = SimulatedWorld(scenario)
        self._scenario = scenario
        self._paces = dict(paces_of or paces(scenario))
        self._speeds, self._delayed, self._factor = speeds or {}, delayed, factor
        seed = scenario.seed if seed is None else seed
        self._draws = {r.name: random.Random(f"{seed}/{r.name}") for r in scenario.robots}
        self._poses = {robot.name: robot.start for robot in scenario.robots}
        self._now = 0.0
        self._numbers = count()
        self._coming: list[tuple[float, int, WorldEvent, Robot, Sequence[Obstacle]]] = []
        self._takes: dict[str, float] = {}
        self._cleared: dict[str, set[str]] = {}
        self._turned: dict[str, tuple[dict[str, float], Works]] = {}
        """By robot: the headings before its action, and who takes part in each part of it."""

    def resume(self, now: float, poses: Mapping[str, Pose]) -> None:
        """Continue at a moment, with robots in these poses and no command under way."""
        self._now = now
        for name, pose in poses.items():
            self._poses[name] = pose
            self._paces[name].placed(now, pose.facing)

    def now(self) -> float:
        return self._now

    def expected(self, robot: Robot) -> float | None:
        """Seconds that the last command of a robot takes."""
        return self._takes.get(robot.name)

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        return self.truth.sense(robot, region)

    def start(self, robot: Robot, pose: Pose, command: int) -> None:
        name, here = robot.name, self._poses[robot.name]
        late = self._factor if self._draws[name].random() < self._delayed else 1.0
        speed = self._speeds.get(name, 1.0)
        took = self._paces[name].step(self._now, here.region, pose.region, late) / speed
        end = self._now + took
        event: Ended = Arrived(end, name, command=command)
        obstacle = self.truth.sense(robot, pose.region)
        if obstacle is not None and self.truth.closed_to(obstacle, robot):
            event = Blocked(end, name, here, obstacle, command=command)
        else:
            self._poses[name] = pose
        self.truth.set_out(robot)
        self._push(took, event, robot)

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        self._cleared[robot.name] = self.truth.cleared = {o.name for o in obstacles}
        works = self.truth.within_reach(robot)
        there = {obstacle.name for obstacle, _ in works}
        event = Acted(self._now, robot.name, command=command)
        facing = {name: self._paces[name].facing for _, group in works for name in group}
        self._turned[robot.name] = facing, works
        took = 0.0
        for obstacle, group in works:
            took += self._action(obstacle, group, self._now + took)
        if not works and all(self.truth.stands(obstacle) for obstacle in obstacles):
            return event
        missing = [o for o in obstacles if o.name not in there and not self.truth.stands(o)]
        self._push(took, event, robot, missing)
        return None

    def _action(self, obstacle: Obstacle, group: Sequence[str], now: float) -> float:
        """Seconds from ``now`` until a group has acted."""
        team = [(self._paces[name], self._poses[name].region) for name in group]
        slowest = min(self._speeds.get(name, 1.0) for name in group)
        return acted_by(team, now, obstacle.region) / slowest

    def cancel(self, robot: Robot) -> None:
        """Do nothing: each command of the simulation ends by itself."""

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        """Return all events of the next moment with an event."""
        times = [self._now + timeout] if timeout is not None else []
        times += [self._coming[0][0]] if self._coming else []
        times += self.times()
        self._now = max(self._now, min(times, default=self._now))
        found: list[WorldEvent] = []
        while self._coming and self._coming[0][0] <= self._now:
            _, _, event, robot, missing = heapq.heappop(self._coming)
            found.append(self._happens(event, robot, missing))
        return found

    def placed(self, robot: Robot, pose: Pose) -> None:
        """Record that an operator has put a robot in ``pose``."""
        self._poses[robot.name] = pose
        self._paces[robot.name].placed(self._now, pose.facing)
        self.truth.move(robot, pose)

    def times(self) -> list[float]:
        return [float(tick) for tick in self.truth.times() if tick > self._now]

    def changes(self, at: float, occupied: Collection[Region]) -> list[Change]:
        return self.truth.changes(int(at), occupied)

    def _push(
        self, took: float, event: WorldEvent, robot: Robot, missing: Sequence[Obstacle] = ()
    ) -> None:
        self._takes[robot.name] = took
        item = (self._now + took, next(self._numbers), event, robot, missing)
        heapq.heappush(self._coming, item)

    def _happens(self, event: WorldEvent, robot: Robot, missing: Sequence[Obstacle]) -> WorldEvent:
        pace, pose = self._paces[robot.name], self._poses[robot.name]
        if isinstance(event, Arrived):
            pace.arrived(self._now)
            self.truth.move(robot, pose)
        elif isinstance(event, Acted):
            self.truth.cleared = self._cleared[robot.name]
            facing, works = self._turned.pop(robot.name)
            found = [
                (obstacle, ActResult.UNTRAVERSABLE if truth is False else ActResult.DONE)
                for obstacle, truth in self.truth.act(robot)
            ]
            changed = {obstacle.name for obstacle, _ in (*self.truth.parts(robot), *found)}
            self._face(facing, [each for each in works if each[0].name in changed])
            found += [(obstacle, ActResult.NOTHING) for obstacle in missing]
            return replace(event, at=self._now, found=tuple(found))
        else:
            pace.placed(self._now, None)
            self.truth.move(robot, pose)
        return event

    def _face(
        self, before: Mapping[str, float], done: Sequence[tuple[Obstacle, Sequence[str]]]
    ) -> None:
        """Let robots face the last obstacle on which their action had an effect: traces do not
        record turns towards others."""
        for name, facing in before.items():
            self._paces[name].facing = facing
        for obstacle, group in done:
            for name in group:
                self._paces[name].faces(self._poses[name].region, obstacle.region)


def paces(scenario: Scenario) -> dict[str, Pace]:
    """A pace for each robot, at its start at time 0."""
    return {robot.name: pace_on(scenario.map, robot) for robot in scenario.robots}


def pace_on(world: RegionMap, robot: Robot) -> Pace:
    """The pace of a robot at its start at time 0."""
    model = robot.model
    side = SIDE if world.frame is None else max(world.frame.resolution)
    motion = resolved(model.motion, model.size, model.speed, model.layer)
    return pace_of(motion, world.cols, side, robot.start.facing, model.timing)
