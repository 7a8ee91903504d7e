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

from safenav.runtime.worlds.protocol import (
    Acted,
    Blocked,
    Change,
    Elsewhere,
    Ended,
    Failed,
    Lost,
    WorldEvent,
)
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.team.state import Is
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Region
from safenav.world.poses import Pose, moves
from support.durations import Uneven

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


class FaultyWorld:
    """A world outside the run, by the protocol of live runs. ``faults``: chances by kind. No
    duration is known in advance; time passes in ``wait`` only."""

    SHOWN = ("now", "sense", "start", "cancel", "placed", "log", "injected")

    def __init__(self, scenario: Scenario, seed: int, faults: Mapping[str, float]) -> None:
        self.nature = Nature(scenario, seed, faults)
        self.inputs, self.cleared = self.nature.truth.inputs, self.nature.clear

    def __getattr__(self, name: str) -> Any:
        if name not in self.SHOWN:
            raise AttributeError(name)
        return getattr(self.nature, name)

    def expected(self, robot: Robot) -> float | None:
        del robot
        return None

    def times(self) -> Sequence[float]:
        return ()

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        for obstacle in obstacles:
            if obstacle.ordered and obstacle.name not in self.nature.truth.truths:
                self.nature.truth.place(obstacle)  # an operator wants it done
        return self.nature.act(robot, obstacles, command)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        told = self.nature.wait(timeout)
        self.nature.changes(self.nature.now(), ())
        return told


class Nature(Uneven):
    """What is so."""

    def __init__(self, scenario: Scenario, seed: int, faults: Mapping[str, float]) -> None:
        random = Random(f"speeds of {seed}")
        speeds = {robot.name: random.uniform(0.5, 2.0) for robot in scenario.robots}
        super().__init__(scenario, speeds=speeds, delayed=0.1, seed=seed)
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

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        there = super().sense(robot, region)
        if there is not None and self._strikes("hidden"):
            self._write("hidden", robot=robot.name, obstacle=there.name)
            return None
        if there is None:
            there = self._ghosts.get(region) or self._ghost(region)
            if there is None:
                return None
            self._write("shown", obstacle=there.name, region=region, there=False)
            return there
        self._write("shown", obstacle=there.name, region=region, there=True)
        return there

    def start(self, robot: Robot, pose: Pose, command: int) -> None:
        name, here = robot.name, self._poses[robot.name]
        busy = name in self._bound or name in self._untold
        super().start(robot, pose, command)
        (item,) = (one for one in self._coming if one[2].command == command)
        event, took = item[2], self._takes[name]
        stops = event.obstacle if isinstance(event, Blocked) else None
        self._untold[name], self._bound[name] = command, {here.region, pose.region}
        self._write(
            "start",
            robot=name,
            origin=here.region,
            to=pose.region,
            command=command,
            busy=busy,
            stops=None if stops is None else stops.name,
        )
        end, share, told = self._fate(robot, here, pose, command, event)
        if told is None:
            return
        self._poses[name] = end
        self._coming.remove(item)
        heapq.heapify(self._coming)
        took *= share
        self._push(took, replace(told, at=self._now + took), robot)

    def _fate(
        self, robot: Robot, here: Pose, pose: Pose, command: int, event: WorldEvent
    ) -> tuple[Pose, float, Ended | None]:
        name = robot.name
        if name in self._dead:
            return here, 0.1, Failed(0.0, name, here, "motor off", fatal=True, command=command)
        if isinstance(event, Blocked):
            return here, 1.0, None
        if self._strikes("abort"):
            return here, 0.8, Failed(0.0, name, here, "no way", command=command)
        if self._strikes("motor"):
            self._dead.add(name)
            return here, 0.5, Failed(0.0, name, here, "motor off", fatal=True, command=command)
        if self._strikes("lost"):
            self._dead.add(name)
            where = frozenset({here.region, pose.region})
            return self._dice.choice([here, pose]), 2.0, Lost(0.0, name, where, command=command)
        if self._strikes("elsewhere"):
            return here, 1.0, Elsewhere(0.0, name, here, command=command)
        return pose, 1.0, None

    def act(self, robot: Robot, obstacles: Sequence[Obstacle], command: int) -> Acted | None:
        name = robot.name
        busy = name in self._bound or name in self._untold
        on = sorted(o.name for o in obstacles)
        if name in self._dead:
            self._write("act", robot=name, on=on, busy=busy)
            failed = tuple((obstacle, ActResult.FAILED) for obstacle in obstacles)
            return self._acted(Acted(self._now, name, failed, "motor off", command=command))
        self._acts_on[name] = obstacles
        event = super().act(robot, obstacles, command)
        if event is None:
            self._untold[name] = command
            self._write("act", robot=name, on=on, busy=busy)
        return event

    def cancel(self, robot: Robot) -> None:
        """Record the request; a command ends by itself."""
        self._write("cancel", robot=robot.name)

    def wait(self, timeout: float | None) -> list[WorldEvent]:
        times = [self._now + timeout] if timeout is not None else []
        times += [heap[0][0] for heap in (self._coming, self._telling) if heap]
        times += self.times()
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
            kind = type(event).__name__.lower()
            found = getattr(event, "obstacle", None)
            fatal = bool(getattr(event, "fatal", False))
            what = {"event": kind, "fatal": fatal, "command": command}
            self._write("told", robot=name, obstacle=found and found.name, **what)
        return told

    def placed(self, robot: Robot, pose: Pose) -> None:
        super().placed(robot, pose)
        self._dead.discard(robot.name)
        self._write("put", robot=robot.name, at=pose.region)

    def changes(self, at: float, occupied: Collection[Region]) -> list[Change]:
        at_or_to = {p.region for p in self._poses.values()}.union(*self._bound.values())
        found = super().changes(at, {*occupied, *at_or_to})
        for change in found:
            kind = "there" if change.appeared else "gone"
            self._write(kind, obstacle=change.obstacle.name, region=change.obstacle.region)
            if change.appeared:
                self._ghosts.pop(change.obstacle.region, None)
        return found

    def clear(self, obstacle: Obstacle) -> None:
        self._ghosts.pop(obstacle.region, None)
        if self.truth.stands(obstacle):
            self.truth.take_away(obstacle.name)
            self.changes(self._now, ())

    # -- nature ------------------------------------------------------------------------------

    def _happens(self, event: WorldEvent, robot: Robot, missing: Sequence[Obstacle]) -> WorldEvent:
        name, at = robot.name, self._now
        for obstacle in missing:
            self._ghosts.pop(obstacle.region, None)
        if isinstance(event, Acted):
            fails = self._strikes("act")
            if fails:
                found = [(o, ActResult.NOTHING) for o in missing]
                there = [o for o in self._acts_on[name] if self.truth.stands(o)]
                found += [(obstacle, ActResult.FAILED) for obstacle in there]
                done: WorldEvent = replace(event, at=at, found=tuple(found), reason="it failed")
            else:
                done = super()._happens(event, robot, missing)
                assert isinstance(done, Acted)
                for obstacle, result in done.found:
                    if result in (ActResult.DONE, ActResult.UNTRAVERSABLE):
                        self._was[obstacle.region] = obstacle
                        open_ = result is ActResult.DONE
                        what = {"obstacle": obstacle.name, "open": open_}
                        self._write("resolved", robot=name, region=obstacle.region, **what)
            return self._acted(done)
        if isinstance(event, Elsewhere):
            sliding = self._sliding(robot)
            self._poses[name] = self._dice.choice([self._poses[name], *sliding])
            event = replace(event, pose=self._poses[name])
        event = replace(super()._happens(event, robot, missing), at=at)
        pose = self._poses[name]
        if name in self._dead:
            self.truth.set_out(robot)
        within = sorted(event.regions) if isinstance(event, Lost) else None
        kind = type(event).__name__.lower()
        self._write("end", robot=name, at=pose.region, how=kind, within=within)
        self._bound.pop(name, None)
        return event

    def _acted(self, event: Acted) -> Acted:
        """Record what an action found, and the stages of all needs."""
        found = {obstacle.name: result.value for obstacle, result in event.found}
        kept, names = self.truth.kept(), [*self._robots]
        stages = {
            one.name: [now.stage.need, sorted(names[i] for i in now.stage.done)]
            for one, now in zip(
                (*self._scenario.obstacles, *kept.added), kept.obstacles, strict=True
            )
            if now.state is Is.OPEN
        }
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
        where = {self._poses[name].region, *(self._log_of_step(name))}
        self._reserved[name] = due, where

    def _log_of_step(self, name: str) -> set[Region]:
        steps = (e for e in reversed(self.log) if e["log"] == "start" and e["robot"] == name)
        return next(({e["origin"], e["to"]} for e in steps), set())

    def _sliding(self, robot: Robot) -> list[Pose]:
        """Return adjacent poses that no robot occupies or approaches, as far as the team knows."""
        here, taken = self._poses[robot.name], {*self.truth.standing()}
        taken |= {p.region for n, p in self._poses.items() if n != robot.name}
        taken |= {r for n, two in self._bound.items() if n != robot.name for r in two}
        at = {n: {p.region, *self._bound.get(n, ())} for n, p in self._poses.items()}
        for entry in self.log:
            if entry["log"] == "end" and entry["within"] and entry["robot"] in self._dead:
                taken |= {*entry["within"]}
        for other, (until, regions) in self._reserved.items():
            if other != robot.name and until >= self._now:
                taken |= regions
                at[other] |= regions
        for each in self._scenario.never_together:
            others = each.robots - {robot.name} if robot.name in each.robots else ()
            if any(not each.regions.isdisjoint(at[other]) for other in others):
                taken |= each.regions
        poses = moves(robot.model.mobility, here, self._scenario.map)
        return [pose for pose in poses if pose.region not in taken]

    def _ghost(self, region: Region) -> Obstacle | None:
        """Return a false sighting: of an obstacle that was here before, or that is elsewhere."""
        taken = {p.region for p in self._poses.values()}.union(*self._bound.values())
        if region in taken:
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
