"""The simulated live world with faults: moves are aborted, end elsewhere or never, motors and
actions fail, sensors are late or see absent obstacles, events come late or twice.

``log`` holds the true events in order of time, whether or not the team was informed: ``start`` and
``end`` of steps, ``act`` and ``acted``, ``shown`` and ``hidden`` of sensors, ``told``, ``put``,
``there``, ``resolved`` and ``gone`` of obstacles.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from random import Random
from typing import Any

from msgspec.structs import replace

from runtime.worlds import Remote, Uneven
from safenav import (
    Acted,
    ActResult,
    Blocked,
    Elsewhere,
    Failed,
    Heading,
    Lost,
    Obstacle,
    Pose,
    Region,
    Robot,
    Scenario,
    WorldEvent,
)

Line = dict[str, Any]

MOST = {
    **{"abort": 0.1, "elsewhere": 0.05, "lost": 0.01, "motor": 0.01, "act": 0.4},
    **{"stale": 0.2, "ghost": 0.01, "hidden": 0.4, "late": 0.15, "twice": 0.2},
}
"""The greatest chance of each fault."""


def faults_of(seed: int) -> dict[str, float]:
    """Some kinds of faults, each with a chance of its own."""
    random = Random(f"faults of {seed}")
    return {kind: random.random() * high for kind, high in MOST.items() if random.random() < 0.6}


class FaultyWorld(Remote):
    """A world outside the run, by the protocol of live runs."""

    hidden = ("changes",)

    def __init__(self, scenario: Scenario, seed: int, faults: Mapping[str, float]) -> None:
        self.simulation: Nature = Nature(scenario, seed, faults)


class Nature(Uneven):
    """The true state. ``faults``: chances by kind. No duration is known in advance; time passes in
    ``wait`` only."""

    def __init__(self, scenario: Scenario, seed: int, faults: Mapping[str, float]) -> None:
        random = Random(f"speeds of {seed}")
        speeds = {robot.name: random.uniform(0.5, 2.0) for robot in scenario.robots}
        super().__init__(scenario, speeds=speeds, delayed=0.1, seed=seed)
        self.inputs = self.truth.inputs
        self.log: list[Line] = []
        self.injected: Counter[str] = Counter()
        self._faults, self._dice = dict(faults), Random(f"strikes of {seed}")
        self._telling: list[tuple[float, int, WorldEvent, str, int]] = []
        self._untold: dict[str, int] = {}
        self._acts_on: dict[str, Sequence[Obstacle]] = {}
        self._bound: dict[str, set[Region]] = {}
        self._reserved: dict[str, tuple[float, set[Region]]] = {}
        self._dead: set[str] = set()
        self._ghosts: dict[Region, Obstacle] = {}
        self._was: dict[Region, Obstacle] = {}
        self._robots = {robot.name: robot for robot in scenario.robots}

    # -- the protocol ------------------------------------------------------------------------

    def expected(self, robot: Robot) -> float | None:
        del robot
        return None

    def times(self) -> list[float]:
        return []

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        there = super().sense(robot, region)
        if there is not None and self._strikes("hidden"):
            self._write("hidden", robot=robot.name, obstacle=there.name)
            return None
        shown = there or self._ghosts.get(region) or self._ghost(region)
        if shown is not None:
            self._write("shown", obstacle=shown.name, region=region, there=there is not None)
        return shown

    def start(self, robot: Robot, pose: Pose, command: int) -> None:
        name, here = robot.name, self._poses[robot.name]
        busy = name in self._bound or name in self._untold
        super().start(robot, pose, command)
        (item,) = (one for one in self._coming if one[2].command == command)
        stops = item[2].obstacle.name if isinstance(item[2], Blocked) and item[2].obstacle else None
        self._untold[name], self._bound[name] = command, {here.region, pose.region}
        what = {"origin": here.region, "to": pose.region, "command": command}
        self._write("start", robot=name, busy=busy, stops=stops, **what)
        fate = self._fate(name, here, pose, stopped=stops is not None)
        if fate is not None:
            self._poses[name], share, event = fate
            self._coming.remove(item)
            heapq.heapify(self._coming)
            took = self._takes[name] * share
            self._push(took, replace(event, at=self._now + took, command=command), robot)

    def _fate(
        self, name: str, here: Pose, pose: Pose, *, stopped: bool
    ) -> tuple[Pose, float, WorldEvent] | None:
        """Where a robot is by a fault, after which share of the step's time, and the event."""
        if name in self._dead:
            return here, 0.1, Failed(0.0, name, here, "motor off", fatal=True)
        if stopped:
            return None
        if self._strikes("abort"):
            return here, 0.8, Failed(0.0, name, here, "no way")
        if self._strikes("motor"):
            self._dead.add(name)
            return here, 0.5, Failed(0.0, name, here, "motor off", fatal=True)
        if self._strikes("lost"):
            self._dead.add(name)
            where = frozenset({here.region, pose.region})
            return self._dice.choice([here, pose]), 2.0, Lost(0.0, name, where)
        return (here, 1.0, Elsewhere(0.0, name, here)) if self._strikes("elsewhere") else None

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        name = robot.name
        for obstacle in obstacles:
            if obstacle.ordered and obstacle.name not in self.truth.truths:
                self.truth.place(obstacle)  # ordered by an operator
        what: Line = {"on": sorted(o.name for o in obstacles)}
        what["busy"] = name in self._bound or name in self._untold
        if name in self._dead:
            self._write("act", robot=name, **what)
            failed = tuple((obstacle, ActResult.FAILED) for obstacle in obstacles)
            return self._acted(Acted(self._now, name, failed, "motor off", command=command))
        self._acts_on[name] = obstacles
        self.truth.absent = {i for i, each in enumerate(self._robots) if each in self._untold}
        event = super().act(robot, obstacles, command)
        if event is None:
            self._untold[name] = command
            self._write("act", robot=name, **what)
        return event

    def cancel(self, robot: Robot) -> None:
        """Record the request; a command ends by itself."""
        self._write("cancel", robot=robot.name)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        times = [self._now + timeout] if timeout is not None else []
        times += [heap[0][0] for heap in (self._coming, self._telling) if heap]
        times += super().times()
        self._now = max(self._now, min(times, default=self._now))
        while self._coming and self._coming[0][0] <= self._now:
            _, number, event, robot, missing = heapq.heappop(self._coming)
            self._tell(self._happens(event, robot, missing), robot.name, number)
        told: list[WorldEvent] = []
        while self._telling and self._telling[0][0] <= self._now:
            _, _, event, name, command = heapq.heappop(self._telling)
            told.append(event)
            if self._untold.get(name) == command:
                del self._untold[name]
            found = getattr(event, "obstacle", None)
            what = {"fatal": getattr(event, "fatal", False), "command": command}
            what |= {"event": type(event).__name__.lower(), "obstacle": found and found.name}
            self._write("told", robot=name, **what)
        self.changes(self._now, ())
        return told

    def placed(self, robot: Robot, pose: Pose) -> None:
        super().placed(robot, pose)
        self._dead.discard(robot.name)
        self._coming = [one for one in self._coming if one[3].name != robot.name]
        heapq.heapify(self._coming)  # a robot that is lifted ends its action
        for command in (self._bound, self._untold, self._reserved):
            command.pop(robot.name, None)
        self._write("put", robot=robot.name, at=pose.region)

    def changes(self, at: float, occupied: Collection[Region]) -> list[Any]:
        found = super().changes(at, {*occupied}.union(*self._occupied().values()))
        for change in found:
            kind, one = "there" if change.appeared else "gone", change.obstacle
            self._write(kind, obstacle=one.name, region=one.region, untold=True)
            if change.appeared:
                self._ghosts.pop(change.obstacle.region, None)
        return found

    def cleared(self, obstacle: Obstacle) -> None:
        self._ghosts.pop(obstacle.region, None)
        if self.truth.stands(obstacle):
            self.truth.remove(obstacle.name)
            self._write("gone", obstacle=obstacle.name, region=obstacle.region)

    # -- nature ------------------------------------------------------------------------------

    def _happens(self, event: WorldEvent, robot: Robot, missing: Sequence[Obstacle]) -> WorldEvent:
        name, at = robot.name, self._now
        for obstacle in missing:
            self._ghosts.pop(obstacle.region, None)
        if isinstance(event, Acted) and self._strikes("act"):
            self.truth.leave(robot)
            found = [(o, ActResult.NOTHING) for o in missing]
            found += [(o, ActResult.FAILED) for o in self._acts_on[name] if self.truth.stands(o)]
            return self._acted(replace(event, at=at, found=tuple(found), reason="it failed"))
        if isinstance(event, Acted):
            done = super()._happens(event, robot, missing)
            assert isinstance(done, Acted)
            for obstacle, result in done.found:
                if result in (ActResult.DONE, ActResult.UNTRAVERSABLE):
                    self._was[obstacle.region] = obstacle
                    what = {"obstacle": obstacle.name, "open": result is ActResult.DONE}
                    self._write("resolved", robot=name, region=obstacle.region, **what)
            return self._acted(done)
        if isinstance(event, Elsewhere):
            sliding = self._sliding(robot)
            self._poses[name] = self._dice.choice([self._poses[name], *sliding])
            event = replace(event, pose=self._poses[name])
        event = replace(super()._happens(event, robot, missing), at=at)
        pose = self._poses[name]
        if name in self._dead:
            self.truth.move(robot, None)
        within, kind = sorted(event.regions) if isinstance(event, Lost) else None, type(event)
        self._write("end", robot=name, at=pose.region, how=kind.__name__.lower(), within=within)
        self._bound.pop(name, None)
        return event

    def _acted(self, event: Acted) -> Acted:
        """Record what an action found, and the stages of all needs."""
        kept, names = self.truth.kept(), [*self._robots]
        listed = *self._scenario.obstacles, *(source for source, _ in kept.added)
        sources = zip(listed, kept.obstacles, strict=True)
        stages = {
            one.name: [now.stage.need, sorted(names[i] for i in now.stage.done)]
            for one, now in sources
            if now.state == "open"
        }
        found = {obstacle.name: result.value for obstacle, result in event.found}
        self._write("acted", robot=event.robot, found=found, stages=stages)
        return event

    def _tell(self, event: WorldEvent, name: str, number: int) -> None:
        command = event.command or 0
        late = not isinstance(event, Elsewhere) and self._strikes("late")
        due = self._now + (self._dice.uniform(0.5, 10.0) if late else 0.0)
        heapq.heappush(self._telling, (due, 2 * number, event, name, command))
        if self._strikes("twice"):
            again = due + self._dice.uniform(0.0, 5.0)
            heapq.heappush(self._telling, (again, 2 * number + 1, event, name, command))
        steps = (e for e in reversed(self.log) if e["log"] == "start" and e["robot"] == name)
        last = next(({e["origin"], e["to"]} for e in steps), set[Region]())
        self._reserved[name] = due, {self._poses[name].region} | last

    def _occupied(self) -> dict[str, set[Region]]:
        """The regions that each robot stands in, leaves or enters."""
        return {n: {p.region, *self._bound.get(n, ())} for n, p in self._poses.items()}

    def _sliding(self, robot: Robot) -> list[Pose]:
        """Return adjacent poses that no robot occupies or approaches, as far as the team knows."""
        at = self._occupied()
        del at[robot.name]
        for other in at:
            until, regions = self._reserved.get(other, (0.0, ()))
            at[other] |= {*regions} if until >= self._now else set()
        taken = {*self.truth.standing()}.union(*at.values())
        for entry in self.log:
            if entry["log"] == "end" and entry["within"] and entry["robot"] in self._dead:
                taken |= {*entry["within"]}
        for each in self._scenario.never_together:
            others = each.robots - {robot.name} if robot.name in each.robots else ()
            if any(not each.regions.isdisjoint(at[other]) for other in others):
                taken |= each.regions
        return [pose for pose in self._near(robot) if pose.region not in taken]

    def _near(self, robot: Robot) -> list[Pose]:
        """The pose of a robot and those after one step; none goes backwards."""
        here, world = self._poses[robot.name], self._scenario.map
        turns = here.heading is not None
        ways = [way for way in Heading if not turns or way is not here.heading.opposite]
        steps = [(world.step(here.region, way), way) for way in ways]
        found = [(to, way) for to, way in steps if to is not None and world.is_free(to)]
        return [here, *(Pose(to, way if turns else None) for to, way in found)]

    def _ghost(self, region: Region) -> Obstacle | None:
        """Return a false sighting: of an obstacle that was here before, or that is elsewhere."""
        if any(region in regions for regions in self._occupied().values()):
            return None
        if region in self._was and self._strikes("stale"):
            self._ghosts[region] = self._was[region]
            return self._was[region]
        listed = [o for o in self._scenario.obstacles if not (o.ordered or o.type.has_truth)]
        if not listed or not self._strikes("ghost"):
            return None
        kind = self._dice.choice(listed).type
        found = Obstacle(kind, region)
        if found.name in {o.name for o in self._scenario.obstacles}:
            return None
        self._ghosts[region] = found
        return found

    def _write(self, kind: str, **more: Any) -> None:
        self.log.append({"log": kind, "t": self._now, **more})

    def _strikes(self, kind: str) -> bool:
        chance = self._faults.get(kind, 0.0)
        if not chance or self._dice.random() >= chance:
            return False
        self.injected[kind] += 1
        return True
