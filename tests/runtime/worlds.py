"""Worlds of users: simulations behind calls, uneven durations, and an empty floor in time."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from math import inf
from random import Random
from typing import Any

from msgspec.structs import replace

from safenav import (
    Acted,
    ActResult,
    Arrived,
    Blocked,
    Elsewhere,
    Failed,
    LiveSimulation,
    Lost,
    Obstacle,
    Pose,
    Region,
    Robot,
    Scenario,
    Sensed,
    SimulatedWorld,
    WorldEvent,
)


class Driven:
    """A world of blocking calls, which forwards the mission's calls to another one, ``truth``.
    ``slides``: by robot and number of its move (from 1) the region in which that ends; ``jams``: by
    robot, how many of its actions have no effect; ``looks``: by robot, whether its first looks show
    an obstacle that is there, the last one also later; ``count``: of moves."""

    def __init__(
        self,
        scenario: Scenario,
        slides: Mapping[str, Mapping[int, Region]] | None = None,
        jams: Mapping[str, int] | None = None,
        looks: Mapping[str, Sequence[bool]] | None = None,
    ) -> None:
        self.truth, self.count = SimulatedWorld(scenario), Counter[str]()
        self.slides, self.jams = slides or {}, dict(jams or {})
        self.obstacles, self.at = scenario.obstacles, dict[str, Region]()
        self.looks = {name: [*told] for name, told in (looks or {}).items()}

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        found, left = self.truth.sense(robot, region), self.looks.get(robot.name, [True])
        sees = found is None or (left.pop(0) if len(left) > 1 else left[0])
        return found if sees else None

    def move(self, robot: Robot, pose: Pose) -> Pose | None:
        self.count[robot.name] += 1
        region = self.slides.get(robot.name, {}).get(self.count[robot.name])
        pose = pose if region is None else replace(pose, region=region)
        self.truth.move(robot, pose)
        return pose

    def act(self, robot: Robot) -> Iterable[tuple[Obstacle, bool | None]]:
        if self.jams.get(robot.name) and self.truth.within_reach(robot):
            self.jams[robot.name] -= 1
            return []
        return self.truth.act(robot)


class Swinging(Driven):
    """The first obstacle is there again whenever the robot that has resolved it has left it."""

    def move(self, robot: Robot, pose: Pose) -> Pose | None:
        (door, *_), at = self.obstacles, self.at.get(robot.name)
        if at == door.region != pose.region and not self.truth.stands(door):
            self.truth.place(door)
        self.at[robot.name] = pose.region
        return super().move(robot, pose)


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
    """One whose time does not stand still while the team waits; results arrive immediately:
    otherwise its progress meanwhile would depend on the machine."""

    hidden = ("expected", "times", "changes")
    pauses = True


class Uneven(LiveSimulation):
    """Steps take other times than the motion of their robots. ``speeds``: factors of the robots'
    speeds; a share ``delayed`` of the steps, drawn from ``seed`` (default: the scenario's), takes
    ``factor`` times as long."""

    def __init__(
        self,
        scenario: Scenario,
        speeds: Mapping[str, float] | None = None,
        delayed: float = 0.0,
        factor: float = 5.0,
        seed: int | None = None,
    ) -> None:
        super().__init__(scenario)
        self.speeds, self._delayed, self._factor = speeds or {}, delayed, factor
        seed = scenario.seed if seed is None else seed
        self._draws = {r.name: Random(f"{seed}/{r.name}") for r in scenario.robots}

    def step_seconds(self, name: str, here: Region, there: Region) -> float:
        late = self._factor if self._draws[name].random() < self._delayed else 1.0
        begin = self._now + 1e-6 * (late > 1.0)  # then from rest, which leaves time for the step
        took = self._paces[name].step(begin, here, there)
        return took * late / self.speeds.get(name, 1.0)

    def action_seconds(self, obstacle: Obstacle, group: Sequence[str], now: float) -> float:
        slowest = min(self.speeds.get(name, 1.0) for name in group)
        return super().action_seconds(obstacle, group, now) / slowest


class Faulty(Uneven):
    """A simulation whose events are changed before the mission receives them. ``faults``: a robot,
    a number of its arrivals (``{to: REGION}``: those there; null: each), what becomes of them, and
    regions; ``jams``: by robot, how many of its actions fail; ``opens``: when a person opens the
    first obstacle, which a sensor reports; ``claims``: actions are reported as done."""

    def __init__(
        self,
        scenario: Scenario,
        faults: Iterable[Sequence[Any]] = (),
        jams: Mapping[str, int] | None = None,
        speeds: Mapping[str, float] | None = None,
        opens: float = inf,
        claims: bool = False,
    ) -> None:
        super().__init__(scenario, speeds=speeds)
        self.scenario, self.faults, self.jams = scenario, [*faults], dict(jams or {})
        self.opens, self.claims = opens, claims
        self.count, self.asked = Counter[str](), dict[str, Sequence[Obstacle]]()
        self.last: dict[str, Pose] = {robot.name: robot.start for robot in scenario.robots}

    def start(self, robot: Robot, pose: Pose, command: int) -> None:
        self.last[robot.name] = self._poses[robot.name]
        super().start(robot, pose, command)

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        self.truth.cleared = {obstacle.name for obstacle in obstacles}
        self.asked[robot.name] = obstacles
        there = [*obstacles, *(o for o, _ in self.truth.within_reach(robot) if o not in obstacles)]
        if not (there and self.jams.get(robot.name)):
            return super().act(robot, obstacles, command)
        self.jams[robot.name] -= 1
        failed = tuple((obstacle, ActResult.FAILED) for obstacle in there)
        return Acted(self.now(), robot.name, failed, command=command)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        if self.opens < inf:
            timeout = min(inf if timeout is None else timeout, self.opens - self.now())
        told = [told for event in super().wait(timeout) for told in self._told(event)]
        if self.now() < self.opens:
            return told
        self.opens, door = inf, self.scenario.obstacles[0]
        self.truth.remove(door.name)
        return [*told, Sensed(self.now(), door, there=False)]

    def _told(self, event: WorldEvent) -> Sequence[Any]:
        if isinstance(event, Acted) and self.claims:
            done = tuple((each, ActResult.DONE) for each in self.asked[event.robot])
            return [replace(event, found=done)]
        if not isinstance(event, Arrived):
            return [event]
        self.count[event.robot] += 1
        here = self._poses[event.robot].region
        for robot, which, what, *where in self.faults:
            if robot == event.robot and which in (None, self.count[robot], {"to": here}):
                return self._struck(event, what, where)
        return [event]

    def _struck(self, event: Arrived, what: Any, where: list[Any]) -> Sequence[Any]:
        if callable(what):
            return list(what(event))
        at, name, command = event.at, event.robot, event.command
        ends = frozenset(where or {self.last[name].region, self._poses[name].region})
        match what:
            case "failed" | "fatal":
                pose = Pose(where[0]) if where else self.last[name]
                self._carry(name, self._poses[name] if where else pose)
                return [Failed(at, name, pose, "slips", what == "fatal", command=command)]
            case "carried":
                self._carry(name, pose := Pose.of(*where))
                return [Elsewhere(at, name, pose, command=command)]
            case "blocked":
                pose = self.last[name]
                self._carry(name, pose)
                return [Blocked(at, name, pose, self.scenario.obstacles[0], command=command)]
            case "elsewhere":
                return [Elsewhere(at, name, Pose(where[0]), command=command)]
            case "lost":
                return [Lost(at, name, ends, command=command)]
            case "seen" | "stale":
                since = at if what == "seen" else 0.0
                return [event, Sensed(since, self.scenario.obstacles[0])]
            case "acted":
                return [Acted(at, name, [], command=command)]
        return {"silent": [], "twice": [event, event], "unasked": [replace(event, command=None)]}[
            what
        ]

    def _carry(self, name: str, pose: Pose) -> None:
        self._poses[name] = pose
        self.truth.move(self.scenario.robot(name), pose)


class Distant(Clocked):
    """Robots with another driver: they do only as commanded."""

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        if not obstacles:
            return Acted(self.simulation.now(), robot.name, command=command)
        return self.simulation.act(robot, obstacles, command)


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
