"""A blocking world as one of commands and events: each command is over when it returns (lockstep),
but for steps that take several ticks by their robots' timing."""

from __future__ import annotations

import random
from collections.abc import Collection, Sequence

from safenav.runtime.worlds import protocol
from safenav.runtime.worlds.checked_world import CheckedWorld
from safenav.runtime.worlds.world import NO_TAKERS, Change, SimulatedWorld, Takers
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region
from safenav.world.moves import Pose


class BlockingAdapter:
    """Lockstep: ``wait`` begins the next tick. Raises WorldError for impossible results."""

    def __init__(self, world: protocol.BlockingWorld, scenario: Scenario) -> None:
        self._world = CheckedWorld(world, scenario)
        self._simulated = world if isinstance(world, SimulatedWorld) else None
        self._draws = {r.name: random.Random(f"{scenario.seed}/{r.name}") for r in scenario.robots}
        self._tick = 0
        self._open: dict[str, tuple[int, Robot, Pose, int]] = {}

    @property
    def idle(self) -> bool:
        return not self._open

    @property
    def left(self) -> tuple[tuple[str, int], ...]:
        """The ticks that steps under way still take."""
        return tuple((name, each[0] - self._tick) for name, each in self._open.items())

    def times(self) -> Sequence[float]:
        """The ticks at which a simulation changes something."""
        return [] if self._simulated is None else [float(t) for t in self._simulated.times()]

    def now(self) -> float:
        return float(self._tick)

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        return self._world.sense(robot, region)

    def start(self, robot: Robot, pose: Pose, command: int) -> protocol.WorldEvent | None:
        ticks = self._duration(robot, pose)
        if ticks == 1:
            return self._moved(robot, pose, command)
        self._open[robot.name] = (self._tick + ticks - 1, robot, pose, command)
        return None

    def ended(self, name: str) -> protocol.Ended | None:
        """The end of a robot's step, if that is due: asked for in its turn, since only then the
        world hears of it."""
        due = self._open.get(name)
        if due is None or self._tick < due[0]:
            return None
        del self._open[name]
        return self._moved(*due[1:])

    def act(
        self, robot: Robot, obstacles: Sequence[Obstacle], command: int, takers: Takers = NO_TAKERS
    ) -> protocol.Acted:
        if self._simulated is not None:  # others do what they can
            self._simulated.works.takers = takers
            self._simulated.cleared = {obstacle.name for obstacle in obstacles}
        found = [
            (obstacle, ActResult.UNTRAVERSABLE if truth is False else ActResult.DONE)
            for obstacle, truth in self._world.act(robot)
        ]
        return protocol.Acted(self.now(), robot.name, tuple(found), command=command)

    def within_reach(self, robot: Robot, cleared: Sequence[Obstacle]) -> bool | None:
        """Whether the robot can act on something where it stands; None if only acting shows it."""
        if self._simulated is None:
            return None
        self._simulated.cleared = {obstacle.name for obstacle in cleared}
        return bool(self._simulated.within_reach(robot))

    def cancel(self, robot: Robot) -> None:
        """A step that is under way ends."""

    def wait(self, timeout: float | None) -> Sequence[protocol.WorldEvent]:
        del timeout
        self._tick += 1
        return ()

    def changes(self, at: float, occupied: Collection[Region]) -> list[Change]:
        return self._world.changes(int(at), occupied)

    def _duration(self, robot: Robot, target: Pose) -> int:
        """Ticks of a step: drawn from the seed if the model leaves it open; staying takes 1."""
        if target.region == self._world.regions[robot.name]:
            return 1
        timing = robot.model.timing
        return self._draws[robot.name].randint(timing.least, timing.most)

    def _moved(self, robot: Robot, pose: Pose, command: int) -> protocol.Ended:
        found = self._world.move(robot, pose)
        if found == pose:
            return protocol.Arrived(self.now(), robot.name, command=command)
        return protocol.Elsewhere(self.now(), robot.name, found, command=command)
