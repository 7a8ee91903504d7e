"""Worlds of users: simulations behind calls, and an empty floor in time."""

from collections.abc import Iterable, Sequence
from typing import Any

from safenav.runtime.worlds.live_simulation import LiveSimulation
from safenav.runtime.worlds.protocol import Acted, Arrived, WorldEvent
from safenav.runtime.worlds.truth import SimulatedWorld
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.world.map import Region
from safenav.world.moves import Pose


class Driven:
    """A world of blocking calls, which forwards the mission's calls to another one, ``truth``.
    ``moves``: number of moves commanded."""

    def __init__(self, scenario: Scenario) -> None:
        self.truth, self.moves = SimulatedWorld(scenario), 0

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        return self.truth.sense(robot, region)

    def move(self, robot: Robot, pose: Pose) -> Pose | None:
        self.moves += 1
        return self.truth.move(robot, pose)

    def act(self, robot: Robot) -> Iterable[tuple[Obstacle, bool | None]]:
        return self.truth.act(robot)


class Remote:
    """A world like any external one: the runtime does not know its state. ``hidden``: methods of
    the simulation behind it that this world lacks."""

    hidden: tuple[str, ...] = ()

    def __init__(self, scenario: Scenario) -> None:
        self.simulation = LiveSimulation(scenario)

    def __getattr__(self, name: str) -> Any:
        if name in self.hidden:
            raise AttributeError(name)
        return getattr(self.simulation, name)


class Clocked(Remote):
    """One whose time does not stand still while the team waits."""

    hidden = ("expected", "times", "changes")


class Bare:
    """A floor without obstacles, whose time passes as it is waited for. ``step``: seconds of one;
    ``pause``: seconds that pass where nothing is awaited."""

    step, pause = 1.0, 0.25

    def __init__(self) -> None:
        self.time, self.coming = 0.0, list[WorldEvent]()

    def now(self) -> float:
        return self.time

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        del robot, region
        return None

    def start(self, robot: Robot, pose: Pose, command: int) -> WorldEvent | None:
        del pose
        self.coming.append(Arrived(self.now() + self.step, robot.name, command=command))
        return None

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted:
        del obstacles
        return Acted(self.now(), robot.name, (), command=command)

    def cancel(self, robot: Robot) -> None:
        """A step ends by itself."""

    def pass_until(self, due: float) -> None:
        self.time = max(self.time, due)

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        times = [event.at for event in self.coming]
        times += [] if timeout is None else [self.now() + timeout]
        self.pass_until(min(times, default=self.now() + self.pause))
        told = [event for event in self.coming if event.at <= self.now()]
        self.coming = [event for event in self.coming if event not in told]
        return told
