"""Drives of random missions in the physics simulation with late messages, judged by the physics
alone: sightings, ends of steps and contacts. The check of motions judges the regions.

``SAFENAV_FUZZ=500`` tries 500 seeds, from ``SAFENAV_FUZZ_FIRST`` on.
"""

from __future__ import annotations

import heapq
import os
import tempfile
from collections.abc import Callable, Collection, Iterator, Sequence
from itertools import count
from math import tau
from pathlib import Path
from random import Random
from typing import Any

import pytest
import yaml
from msgspec import Struct

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from drawn import tried
from fleet.lab import Drive, drive_in, watched
from safenav import (
    ActResult,
    Diagnostic,
    InputError,
    Scenario,
    Sensed,
    UsageError,
    WorldEvent,
    check_trace,
    load_scenario_text,
)
from safenav.fleet import transport
from safenav.fleet.file import FleetFile, load_fleet
from safenav.fleet.lab.physics import body_of
from safenav.fleet.lab.simulation import SimulationTransport
from safenav.fleet.world import FleetWorld
from safenav.trace import records
from safenav.trace.vocabulary import MoveEnd
from support.floors import free_in, rooms
from support.missions import SIDES, Data, mission

FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
COUNT = int(os.environ.get("SAFENAV_FUZZ", "5"))
MOST = 1.5
"""Seconds by which a message comes late at most."""
TOLD_OF_TRANSPORT = ("measured clock", "measured rate")
"""Rules of motions that say of a drive that its messages came late, or that clocks differ."""
KINDS = {
    transport.Located: "odometry",
    transport.Scanned: "scan",
    transport.Reported: "report",
    transport.GoalEnded: "goal",
    transport.Performed: "action",
}
"""Each kind of message of each robot has its own channel."""


@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_drives_with_late_messages_agree_with_the_physics(
    seed: int, played: Callable[[], None]
) -> None:
    defects = tried(late_drive, seed)
    assert defects == []
    played()


def late_drive(seed: int) -> list[str]:
    """Drive a random mission; return the violated requirements. Raises InputError for a mission
    that is refused."""
    random, data = Random(f"drive {seed}"), late_mission(seed)
    hidden = data["obstacles"]
    if not any("from" in one for one in hidden):
        data["obstacles"] = []  # unknown to the team
    scenario = load_scenario_text(yaml.safe_dump(data, sort_keys=False), "late.yaml")
    heard = list[records.Record]()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "fleet.yaml"
        file.write_text(yaml.safe_dump(fleet_of(random, hidden, scenario)))
        fleet = load_fleet(file, scenario)
        try:
            world = Listening(scenario, fleet, random)
        except UsageError as error:
            raise InputError([Diagnostic("late.yaml", 0, 0, str(error))]) from error
        trace = Path(folder) / "trace.jsonl"
        drive = drive_in(world, scenario, fleet.stations, trace, [heard.append])
    defects = Judge(world, heard, drive.began).defects
    defects += [f"trace: {finding}" for finding in check_trace(drive.lines).findings]
    follow = any(station.follow is not None for station in fleet.stations.values())
    return defects + _motion_defects(drive, heard, ["tracking"] if follow else [])


def _motion_defects(
    drive: Drive, heard: Sequence[records.Record], excused: Collection[str]
) -> list[str]:
    """What the check of motions finds, other than of a robot that acts: it reaches beyond its
    region."""
    acts, begun = list[tuple[str, float, float]](), dict[int, records.Act]()
    for line in heard:
        if isinstance(line, records.Act):
            begun[line.command] = line
        elif isinstance(line, records.ActionEnd) and line.command in begun:
            act = begun.pop(line.command)
            acts += [(name, act.t or 0.0, line.t or 0.0) for name in act.robots]
    try:
        found = drive.judged()
    except UsageError:  # a body that is too large for its regions
        return []
    return [
        f"motion: {one}"
        for one in found
        if one.rule not in (*TOLD_OF_TRANSPORT, *excused)
        and not (
            one.rule == "measured room"
            and any(name == one.robot and since <= one.t <= end for name, since, end in acts)
        )
    ]


# Random small scenarios for drives, and their fleets.


def late_mission(seed: int) -> Data:
    """A mixed mission for a drive: on a real clock, all obstacles with bodies of one type, which
    the lidars see."""
    random = Random(f"late {seed}")
    limits = {"ticks": 300, "synthesis_seconds": 20, "seconds": 240}
    if random.random() < 0.5:
        return _rooms(random) | {"limits": limits, "clock": "live"}
    data = mission("metric", seed) | {"limits": limits, "clock": "live"}
    data["until"].pop("by", None)
    data.pop("late", None)
    for robot in data["robots"].values():
        robot["objective"].pop("within", None)
        robot.pop("avoids", None)  # bodies do not share a region
    types, solid = data["catalogue"]["obstacles"].items(), None
    seen = {"uncertainty", *(name for name, kind in types if kind.get("has_truth"))}
    for obstacle in data["obstacles"]:
        obstacle.pop("resolve_within", None)
        if obstacle["type"] not in seen:
            solid = solid or obstacle["type"]
            obstacle["type"] = solid
    data["map"].setdefault("resolution", random.choice(SIDES))
    return data


def _rooms(random: Random) -> Data:
    """Two or three rooms with doors between them, and robots that cross them."""
    width = random.choice([1, 2, 3])
    grid = rooms(random, 1, random.choice([2, 2, 3]), random.choice([1, 2, 2, 3]), width)
    free = free_in(grid)
    places = [region for region in free if region % len(grid[0]) % (width + 1) == 0]
    inside = [region for region in free if region not in places]
    robots: Data = {}
    many = min(random.choice([1, 2, 2, 3]), len(inside) - 1)
    for k, start in enumerate(random.sample(inside, many)):
        aims = random.sample(inside, 2)
        robots[f"r{k}"] = {
            "model": random.choice(["jackal", "mir250", "spot", "digit", "quadcopter", "tugger"]),
            "start": start,
            "objective": random.choice([{"visit": aims}, {"visit": aims[:1]}, {"cover": aims}]),
        }
        if robots[f"r{k}"]["model"] == "digit":
            robots[f"r{k}"]["heading"] = random.choice(["north", "east", "south", "west"])
    tugger = {"mobility": "free", "layer": "ground", "capabilities": ["push"]}
    kind, doors = random.choice(["door", "door", "door", "debris"]), random.choice([1, 2])
    hidden = [{"type": kind, "region": p} for p in places if random.random() < 0.8]
    return {
        "safenav": 1,
        "map": {"grid": grid, "resolution": random.choice([1.8, 2.0, 2.4])},
        "catalogue": {"robots": {"tugger": tugger | {"size": 0.5, "speed": 0.8}}},
        "robots": robots,
        "obstacles": hidden[:doors],
        "until": {"rounds": random.choice([1, 1, 2])},
    }


def fleet_of(random: Random, hidden: list[Data], scenario: Scenario) -> Data:
    """The fleet of a scenario's robots in simulation. ``hidden``: the obstacles that are there."""
    side = min(scenario.map.frame.resolution) if scenario.map.frame is not None else 1.0
    kinds = scenario.catalogue.obstacles
    solid = [one["type"] for one in hidden if not kinds[one["type"]].has_truth]
    robots: Data = {}
    for robot in scenario.robots:
        room = (side - body_of(robot).radius * 2) / 2
        robots[robot.name] = {
            "act": {action: action for action in sorted(robot.capabilities)},
            "speed": robot.model.speed or 0.5,
            "tolerance": round(min(0.3, max(0.06, room)), 3),
            **({"scan": {"obstacle": solid[0]}} if solid else {}),
        }
    defaults: Data = {"timeout": random.choice([3, 6]), "report": "obstacles"}
    return {
        "safenav-fleet": 1,
        "transport": "simulation",
        "simulation": {"pace": 1e9} | ({} if scenario.obstacles else {"obstacles": hidden}),
        "defaults": defaults | ({"follow": {}} if random.random() < 0.2 else {}),
        "robots": robots,
    }


# The simulation behind a transport with late messages: each channel keeps the order and has its own
# delays, and robots' clocks differ in offset and speed, and may be set.


class Channel(Struct):
    """``late``: the least and the most seconds of a message; ``burst``: seconds of which the
    messages come together; ``drops``: seconds of silence, now and then; ``twice``: whether messages
    may come again. ``last``: when the newest one comes; ``silent``: the end of a silence."""

    late: tuple[float, float] = (0.0, 0.0)
    burst: float = 0.0
    drops: float = 0.0
    twice: bool = False
    last: float = 0.0
    silent: float = 0.0

    def comes(self, now: float, random: Random) -> float | None:
        """Return the arrival time of a message that is sent now; None: never."""
        if self.drops and now >= self.silent and random.random() < 0.02:
            self.silent = now + self.drops
        elif now < self.silent:
            return None
        at = now + random.uniform(*self.late)
        if self.burst:
            at = max(now, (now // self.burst + 1) * self.burst)
        self.last = max(self.last, at)
        return self.last


def channel_of(random: Random, how: str, channel: str) -> Channel:
    """A channel with random delays. ``how``: none, steady, random or bursts."""
    least = random.choice([0.0, 0.3, random.uniform(0.0, MOST)])
    late = {"steady": (least, least), "random": (0.0, random.choice([0.3, MOST]))}
    made = Channel(late.get(how, (0.0, 0.0)))
    made.burst = random.uniform(0.2, MOST) if how == "bursts" else 0.0
    if channel == "odometry" and how in ("none", "random"):
        made.drops = random.choice([0.0, 0.0, 0.3])
    made.twice = channel in ("goal", "action", "report") and random.random() < 0.3
    return made


class RobotClock(Struct):
    """A robot's own clock: ``offset`` seconds ahead, with relative speed ``speed``; at ``set_at``
    it is set back by ``back`` seconds."""

    offset: float
    speed: float = 1.0
    set_at: float = 1e9
    back: float = 0.0

    def stamp(self, now: float) -> float:
        return self.offset + self.speed * now - self.back * (now >= self.set_at)


def clock_of(random: Random) -> RobotClock:
    one = RobotClock(random.choice([0.0, 0.0, random.uniform(-1e4, 1e4)]))
    if random.random() < 0.2:
        one.speed = random.choice([0.2, 5.0])
    if random.random() < 0.25:
        one.set_at, one.back = random.uniform(2, 40), random.choice([0.4, 3.0, 3600.0, -3600.0])
    return one


class Moment(Struct):
    """The physics at a time: positions of robots, obstacles that stand, new contacts, acting
    robots."""

    t: float
    at: dict[str, tuple[float, float, float]]
    stands: frozenset[str]
    touches: list[tuple[str, str]]
    acting: frozenset[str]


class LateTransport(SimulationTransport):
    """The simulation, heard late. Lidars also look while their robot moves. ``moments``: the log of
    the physics, independent of the run."""

    def __init__(self, scenario: Scenario, fleet: FleetFile, random: Random) -> None:
        super().__init__(scenario, fleet.stations, fleet.simulation)
        self._random, self._channels = random, dict[tuple[str, str], Channel]()
        kind = random.choice(["steady", "random", "random", "bursts", "mixed", "mixed", "mixed"])
        for name, station in fleet.stations.items():
            for channel in KINDS.values():
                mixed = random.choice(["none", "steady", "random", "bursts"])
                made = channel_of(random, mixed if kind == "mixed" else kind, channel)
                if channel == "odometry" and station.follow is not None:
                    made = Channel((0.0, 0.05))  # late odometry of a follower is a deviation
                self._channels[name, channel] = made
        self._clocks = {name: clock_of(random) for name in fleet.stations}
        self._sent: list[tuple[float, int, transport.Message]] = []
        self._numbers = count()
        self.moments: list[Moment] = []
        self._touched: dict[tuple[str, str], int] = {}
        watched(self.physics)

    def step(self) -> None:
        self._due = 0.0
        super().step()
        physics: Any = self.physics
        new = [pair for pair, n in physics.contacts.items() if n > self._touched.get(pair, 0)]
        self._touched = dict(physics.contacts)
        at = {name: physics._at(body) for name, body in physics._bodies.items()}
        acting = frozenset(n for n, body in physics._bodies.items() if body.acts is not None)
        self.moments.append(Moment(physics.now, at, frozenset(physics.standing), new, acting))
        while self._sent and self._sent[0][0] <= self.physics.now:
            self._post(heapq.heappop(self._sent)[2])

    def _send(self, name: str, message: transport.Message) -> None:
        channel = self._channels[name, KINDS[type(message)]]
        for _ in range(1 + (channel.twice and self._random.random() < 0.3)):
            at = channel.comes(self.physics.now, self._random)
            if at is not None:
                heapq.heappush(self._sent, (at, next(self._numbers), message))

    def _tell(self, name: str, state: dict[str, Any], *, looks: bool) -> None:
        stamp = self._clocks[name].stamp(state["now"])
        self._send(name, transport.Located(name, stamp, state["x"], state["y"], state["yaw"]))
        if state["end"] is not None:
            end = transport.GoalEnd(state["end"])
            self._send(name, transport.GoalEnded(name, self._goals[name], end))
        if state["acted"] is not None:
            result = ActResult(state["acted"])
            self._send(name, transport.Performed(name, self._acts[name], result))
        if not looks:
            return
        if self._stations[name].scan is not None:
            _, ranges = self.physics.scan(name)
            self._send(name, transport.Scanned(name, stamp, 0.0, tau / len(ranges), ranges))
        if not state["moves"] and self._stations[name].report is not None:
            for found in filter(None, self.physics.noticed(name).values()):
                self._send(name, transport.Reported(name, found))


class Listening(FleetWorld):
    """Keeps what it tells of obstacles, ``sensed``."""

    def __init__(self, scenario: Scenario, fleet: FleetFile, random: Random) -> None:
        self.team = {robot.name: robot for robot in scenario.robots}
        self.stations, self.late = fleet.stations, LateTransport(scenario, fleet, random)
        self.sensed: list[Sensed] = []
        super().__init__(scenario, fleet.stations, self.late, transport.DriveRecording())

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        events = super().wait(timeout)
        self.sensed += [event for event in events if isinstance(event, Sensed)]
        return events


class Judge:
    """Compares a trace with the log of the physics. ``zero``: the begin of the run."""

    def __init__(self, world: Listening, lines: Sequence[records.Record], zero: float) -> None:
        self._team, self._stations, self._places = world.team, world.stations, world.goals.places
        self._moments, self._sensed, self._zero = world.late.moments, world.sensed, zero
        self.defects: list[str] = []
        self._sightings()
        for line in lines:
            if isinstance(line, records.Arrive) and not self._bumped(line.robot, line.t or 0.0):
                self._end(line, line.robot, line.t or 0.0)
        self._contacts()

    def _wrong(self, t: float, what: str) -> None:
        self.defects.append(f"{t:.2f} s: {what}")

    def _around(self, t: float, before: float, after: float = 0.05) -> Iterator[Moment]:
        at = t + self._zero
        return (one for one in self._moments if at - before <= one.t <= at + after)

    def _sightings(self) -> None:
        """What is seen was there, and what is gone was not, within the last 3 seconds."""
        for event in self._sensed:
            t, name = event.at - self._zero, event.obstacle.name
            if name.startswith(("lost_", "unknown_")):
                continue
            stood = [name in one.stands for one in self._around(t, 3.0)]
            if event.there and not any(stood):
                self._wrong(t, f"{event.by} has not seen {name}")
            elif not event.there and all(stood):
                self._wrong(t, f"{event.by} tells that {name} is gone")

    def _end(self, line: records.Arrive, name: str, t: float) -> None:
        """Check that a step ends where the trace says."""
        x, y, yaw = [*self._around(t, 0.05)][-1].at[name]
        here, station = self._places.region(x, y), self._stations[name]
        if line.result is MoveEnd.LOST:
            if here not in (line.regions or ()):
                self._wrong(t, f"{name} is in {here}, not lost in {line.regions}")
            return
        half = float(max(self._places.frame.resolution)) / 2
        limit = (station.tolerance if station.follow is None else half) + 0.05
        far = self._places.distance(line.at, x, y)
        if here != line.at or far > limit:
            self._wrong(t, f"{name} {line.result} {far:.2f} m from the centre of {line.at}")
        facing = self._places.heading(yaw).label
        if line.heading not in (None, facing):
            self._wrong(t, f"{name} {line.result}: faces {facing}, not {line.heading}")

    def _contacts(self) -> None:
        """Check that no robot touches another one, or an obstacle on which it does not act and of
        which nobody knew: into a known one only a robot that resolves it may go."""
        for one in self._moments:
            t, found = one.t - self._zero, list[str]()
            for pair in one.touches if t >= 0 else ():
                robots = [name for name in pair if name in one.at]
                if len(robots) == 2 and self._team[robots[0]].conflicts(self._team[robots[1]]):
                    found.append(f"{pair[0]} touches {pair[1]}")
                for thing in {*pair} - {*robots} - {"wall"}:
                    told = (e for e in self._sensed if e.there and e.obstacle.name == thing)
                    known = any(event.at < one.t for event in told)
                    acts = any(robots[0] in m.acting for m in (one, *self._around(t, 1.0)))
                    if thing in one.stands and not acts and not known:
                        found.append(f"{robots[0]} touches {thing}")
            for what in found:
                if not any(what in told for told in self.defects):
                    self._wrong(t, what)

    def _bumped(self, name: str, t: float) -> bool:
        """Whether a robot touches another one, which the scenario lets share its regions."""
        pairs = (pair for one in self._around(t, 0.5) for pair in one.touches)
        return any(name in pair and {*pair} <= self._team.keys() for pair in pairs)
