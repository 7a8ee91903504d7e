"""A floor with robots in continuous virtual time: moves take time, stop at obstacles, and fail.

It reads the mission like the campaigns' judge, and does not use safenav. Commands and events are
plain data. Its ``log`` holds the true events in order of time, whether or not they were reported:

- ``start``: ``robot`` sets out ``from`` a region ``to`` another by a ``command``; ``stops``: the
  obstacle that will stop it
- ``end``: of that, ``at`` a region; ``how``; a robot that is ``lost`` stands in one of ``within``
- ``act``, ``acted``: an action of ``robot`` begins and ends; ``resolved``: an obstacle is gone for
  good (``open`` false: it was found to be a wall)
- ``shown``: a sensor shows ``obstacle``, whether there or not; ``hidden``: it fails to
- ``cancel``: a robot was asked to give up its step
- ``told``: an event was handed over; ``put``: an operator has put a robot down; ``wrong``: a
  command that no robot can carry out
"""

import heapq
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from random import Random
from typing import Any

from campaigns.judge.mission import HEADINGS, Mission, Obstacle, Robot, read_mission
from campaigns.judge.situation import FIRST, Stage

Line = dict[str, Any]

FAULTS = (
    *("abort", "elsewhere", "lost", "motor", "act"),
    *("stale", "ghost", "late", "told_late", "told_twice"),
)
"""Kinds of faults, by their chances: of a move, an action, a look, an event."""


@dataclass
class Floor:
    """``data``: of a scenario; ``seed``: of speeds, delays and faults, whatever the order of
    commands; ``faults``: chances by kind."""

    data: Mapping[str, Any]
    seed: int = 0
    faults: Mapping[str, float] = field(default_factory=dict)
    delay: float = 0.1
    factor: float = 5.0
    act_seconds: float = 2.0

    def __post_init__(self) -> None:
        self.mission: Mission = read_mission(self.data)
        self.robots: dict[str, Robot] = {robot.name: robot for robot in self.mission.robots}
        self.pose = {name: robot.start for name, robot in self.robots.items()}
        self.log: list[Line] = []
        self.time, self._heap, self._ticket = 0.0, list[Any](), count()
        self._reserved: dict[str, tuple[float, set[int]]] = {}
        self.open: dict[str, int] = {}
        """The command of each robot that has not been told of its end."""
        self.moving: dict[str, int] = {}
        """Robots on their way or acting, with their command."""
        self.bound: dict[str, int] = {}
        self.dead: set[str] = set()
        self.stage: dict[str, Stage] = dict.fromkeys(self.mission.obstacles, FIRST)
        self.walls: set[str] = set()
        self.ghosts: dict[str, Obstacle] = {}
        self.was: dict[str, Obstacle] = {}
        self.injected: Counter[str] = Counter()
        self._count: Counter[str] = Counter()
        self._dice = Random(f"faults {self.seed}")
        self.truth = {}
        entries = self.data.get("obstacles") or ()
        for entry, (name, it) in zip(entries, self.mission.obstacles.items(), strict=True):
            self.truth[name] = entry.get("traversable", True) if it.has_truth else None
        speeds = {name: Random(f"{self.seed} {name}").uniform(0.5, 2.0) for name in self.robots}
        self.speed: dict[str, float] = speeds

    # -- the protocol, in plain data ---------------------------------------------------------

    def now(self) -> float:
        return self.time

    def sense(self, robot: str, region: int) -> str | None:
        """Return the obstacle in a region, as sensed."""
        there = next((n for n, o in self._standing().items() if o.region == region), None)
        ghost = next((n for n, o in self.ghosts.items() if o.region == region), None)
        if there is not None and self._strikes("late"):
            self._write("hidden", robot=robot, obstacle=there)
            return None
        if there is None and ghost is None:
            ghost = self._ghost(region)
        if (found := there or ghost) is not None:
            self._write("shown", robot=robot, obstacle=found, there=there is not None)
        return found

    def start(self, name: str, region: int, heading: str | None, command: int) -> None:
        """Send a robot to a neighbouring region."""
        robot, here = self.robots[name], self.pose[name]
        to = (region, HEADINGS.index(heading) if robot.has_heading and heading else -1)
        if name in self.moving or to not in self.mission.steps(robot, here):
            self._write("wrong", robot=name, to=region, busy=name in self.moving)
        took = self._duration(name)
        stops = next(
            (n for n, o in self._standing().items() if self._stops(n, o, to[0], name)), None
        )
        self._begin(name, command, region)
        line = {"from": here[0], "to": region, "command": command, "stops": stops}
        self._write("start", robot=name, **line)
        told: Line = {"robot": name, "command": command}
        back = {"region": here[0], "heading": _spelt(here[1])}
        if name in self.dead:
            end, after, told = here, 0.1, told | back | {"event": "failed", "fatal": True}
        elif stops is not None:
            end, after, told = here, 0.6, told | back | {"event": "blocked", "obstacle": stops}
        elif self._strikes("abort"):
            end, after, told = here, 0.8, told | back | {"event": "failed", "fatal": False}
        elif self._strikes("motor"):
            end, after, told = here, 0.5, told | back | {"event": "failed", "fatal": True}
            self.dead.add(name)
        elif self._strikes("lost"):
            end, after = self._dice.choice([here, to]), 2.0
            told |= {"event": "lost", "within": sorted({here[0], region})}
            self.dead.add(name)
        elif self._strikes("elsewhere"):
            end, after, told = here, 1.0, told | {"event": "elsewhere"}
        else:
            end, after, told = to, 1.0, told | {"event": "arrived"}
        self._plan(self.time + after * took, "end", name, end, told)

    def act(self, name: str, believed: Sequence[str], command: int) -> Line | None:
        """Let a robot perform its actions at its pose. The answer is immediate if there is nothing
        to do, and always covers each obstacle at which the team believes it to be."""
        if name in self.moving:
            self._write("wrong", robot=name, act=True, busy=True)
        if name in self.dead or not any(self._can(name, one) for one in self.stage):
            return self._acted(name, believed, command, fails=name in self.dead)
        self._begin(name, command, None)
        self._write("act", robot=name, command=command, on=list(believed))
        seconds = self.act_seconds / self.speed[name]
        self._plan(self.time + seconds, "acted", name, tuple(believed), command)
        return None

    def cancel(self, name: str) -> None:
        """Record the request; the step continues."""
        self._write("cancel", robot=name)

    def wait(self, timeout: float | None) -> list[Line]:
        """Return the events of the next instant that has any; none after the time limit."""
        until = float("inf") if timeout is None else self.time + timeout
        told: list[Line] = []
        while self._heap and self._heap[0][0] <= until:
            if told and self._heap[0][0] > self.time:
                break
            self.time, _, kind, *about = heapq.heappop(self._heap)
            if kind == "end":
                self._ended(*about)
            elif kind == "acted":
                name, believed, command = about
                self._tell(self._acted(name, believed, command, fails=self._strikes("act")))
            else:
                (event,) = about
                told.append(event)
                if self.open.get(event["robot"]) == event["command"]:
                    del self.open[event["robot"]]
                self._write("told", **event)
        if not told and until < float("inf"):
            self.time = until
        return told

    # -- what an operator does ---------------------------------------------------------------

    def put(self, name: str, region: int, heading: str | None) -> None:
        """An operator puts a robot down somewhere, repaired."""
        robot = self.robots[name]
        self.pose[name] = (region, HEADINGS.index(heading) if robot.has_heading and heading else -1)
        self.dead.discard(name)
        self._write("put", robot=name, at=region)

    def where(self, name: str) -> tuple[int, str | None]:
        region, heading = self.pose[name]
        return region, _spelt(heading)

    # -- nature ------------------------------------------------------------------------------

    def _write(self, kind: str, **more: Any) -> None:
        self.log.append({"log": kind, "t": self.time, **more})

    def _strikes(self, kind: str) -> bool:
        chance = self.faults.get(kind, 0.0)
        if not chance or self._dice.random() >= chance:
            return False
        self.injected[kind] += 1
        return True

    def _duration(self, name: str) -> float:
        self._count[name] += 1
        draw = Random(f"{self.seed} {name} {self._count[name]}").random()
        return (self.factor if draw < self.delay else 1.0) / self.speed[name]

    def _standing(self) -> dict[str, Obstacle]:
        return {
            n: o for n, o in self.mission.obstacles.items() if n in self.stage or n in self.walls
        }

    def _stops(self, name: str, obstacle: Obstacle, region: int, robot: str) -> bool:
        if obstacle.region != region or robot not in obstacle.blocks:
            return False
        return name in self.walls or self.mission.blocked(
            self.robots[robot], obstacle, self.stage[name][0]
        )

    def _ghost(self, region: int) -> str | None:
        """Return a false sighting: of an obstacle that was here before, or that is elsewhere."""
        taken = {p[0] for p in self.pose.values()} | {*self.bound.values()}
        kinds = sorted(
            {n.split("@")[0] for n, o in self.mission.obstacles.items() if not o.has_truth}
        )
        gone = [n for n, o in self.was.items() if o.region == region]
        if gone and self._strikes("stale"):
            self.ghosts[gone[0]] = self.was[gone[0]]
            return gone[0]
        if not kinds or region in taken or not self._strikes("ghost"):
            return None
        kind = self._dice.choice(kinds)
        entries = [*self.data["obstacles"], {"type": kind, "region": region}]
        found = read_mission({**self.data, "obstacles": entries}).obstacles[f"{kind}@{region}"]
        self.ghosts[found.name] = found
        return found.name

    def _begin(self, name: str, command: int, bound: int | None) -> None:
        self.open[name] = self.moving[name] = command
        if bound is not None:
            self.bound[name] = bound

    def _plan(self, at: float, kind: str, *about: Any) -> None:
        heapq.heappush(self._heap, (at, next(self._ticket), kind, *about))

    def _ended(self, name: str, end: tuple[int, int], told: Line) -> None:
        if told["event"] == "elsewhere":
            end = self._dice.choice([end, *self._sliding(name)])
            told |= {"region": end[0], "heading": _spelt(end[1])}
        self.moving.pop(name, None)
        had = {self.pose[name][0], self.bound.pop(name, end[0])}
        self.pose[name] = end
        within = {"within": told["within"]} if "within" in told else {}
        self._write("end", robot=name, at=end[0], how=told["event"], **within)
        self._reserved[name] = self._tell(told), had

    def _sliding(self, name: str) -> list[tuple[int, int]]:
        """Return adjacent poses that no robot occupies or approaches, as far as the team knows."""
        taken = {p[0] for n, p in self.pose.items() if n != name} | {
            r for n, r in self.bound.items() if n != name
        }
        taken |= {o.region for o in self._standing().values()}
        for other, (until, regions) in self._reserved.items():
            if other != name and until >= self.time:
                taken |= regions
        return [
            p for p in self.mission.steps(self.robots[name], self.pose[name]) if p[0] not in taken
        ]

    def _tell(self, event: Line) -> float:
        """Hand an event over: now, or later if that leaves the robot within what it has reserved;
        perhaps twice. When it is told."""
        event = {**event, "at": self.time}
        later = event["event"] != "elsewhere" and self._strikes("told_late")
        due = self.time + (self._dice.uniform(0.5, 10.0) if later else 0.0)
        self._plan(due, "tell", event)
        if self._strikes("told_twice"):
            self._plan(due + self._dice.uniform(0.0, 5.0), "tell", event)
        return due

    def _can(self, name: str, obstacle: str) -> bool:
        """Return whether a robot can fulfil the next need of an obstacle, with the other robots at
        their poses."""
        index, done = self.stage[obstacle]
        need = self.mission.obstacles[obstacle].needs[index]
        there = self._there(need.action, need.at)
        return name in there and (len(there) >= need.robots if need.together else name not in done)

    def _there(self, action: str, at: frozenset[int]) -> set[str]:
        return {
            name
            for name, robot in self.robots.items()
            if action in robot.capabilities
            and self.pose[name][0] in at
            and name not in self.bound
            and name not in self.dead
        }

    def _acted(self, name: str, believed: Sequence[str], command: int, *, fails: bool) -> Line:
        self.moving.pop(name, None)
        found: dict[str, str] = {}
        for obstacle in [n for n in self.stage if self._can(name, n)]:
            if fails:
                found[obstacle] = "failed"
                continue
            while obstacle in self.stage and self._can(name, obstacle):
                self._advance(name, obstacle)
            found[obstacle] = "done" if obstacle not in self.stage else "part"
            if obstacle in self.walls:
                found[obstacle] = "untraversable"
        for obstacle in believed:
            there = obstacle in self._standing()
            found.setdefault(obstacle, "failed" if there else "nothing")
            if not there:
                self.ghosts.pop(obstacle, None)
        stages = {n: [index, sorted(done)] for n, (index, done) in self.stage.items()}
        self._write("acted", robot=name, found=found, stages=stages)
        event = {"event": "acted", "robot": name, "found": found}
        return event | {"command": command, "at": self.time}

    def _advance(self, name: str, obstacle: str) -> None:
        index, done = self.stage[obstacle]
        it = self.mission.obstacles[obstacle]
        need = it.needs[index]
        group = self._there(need.action, need.at) if need.together else done | {name}
        if len(group) < need.robots:
            self.stage[obstacle] = (index, frozenset(group))
            return
        self.stage[obstacle] = (index + 1, FIRST[1])
        if index + 1 < len(it.needs):
            return
        del self.stage[obstacle]
        self.was[obstacle] = it
        if self.truth.get(obstacle) is False:
            self.walls.add(obstacle)
        self._write("resolved", robot=name, obstacle=obstacle, open=obstacle not in self.walls)


def _spelt(heading: int) -> str | None:
    return HEADINGS[heading] if heading >= 0 else None
