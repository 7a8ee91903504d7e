"""The physics simulation behind a transport with late messages: each channel keeps the order and
has its own delays, and robots' clocks differ in offset and speed, and may be set."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from itertools import count
from math import tau
from pathlib import Path
from random import Random
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from fleet.lab import watched
from safenav import Scenario, Sensed, WorldEvent
from safenav.fleet import transport
from safenav.fleet.file import load_fleet
from safenav.fleet.lab.simulation import SimulationTransport
from safenav.fleet.world import FleetWorld

MOST = 1.5
"""Seconds by which a message comes late at most."""
KINDS = {
    transport.Located: "odometry",
    transport.Scanned: "scan",
    transport.Reported: "report",
    transport.GoalEnded: "goal",
    transport.Performed: "action",
}
"""Each kind of message of each robot has its own channel."""


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

    def __init__(self, scenario: Scenario, fleet: Any, random: Random) -> None:
        super().__init__(scenario, fleet)
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

    def _tell(self, name: str, *, looks: bool) -> None:
        located, ended = self.physics.told(name)
        stamp = self._clocks[name].stamp(located.stamp)
        for each in (replace(located, stamp=stamp), *ended):
            self._send(name, each)
        if not looks:
            return
        if self._stations[name].scan is not None:
            _, ranges = self.physics.scan(name)
            self._send(name, transport.Scanned(name, stamp, 0.0, tau / len(ranges), ranges))
        if not self.physics.moves(name) and self._stations[name].report is not None:
            for found in filter(None, self.physics.noticed(name).values()):
                self._send(name, transport.Reported(name, found))


class Listening(FleetWorld):
    """The fleet of a file in this simulation. Keeps what it tells of obstacles, ``sensed``."""

    def __init__(self, scenario: Scenario, file: Path, random: Random) -> None:
        fleet = load_fleet(file, scenario)
        self.team = {robot.name: robot for robot in scenario.robots}
        self.stations, self.late = fleet.stations, LateTransport(scenario, fleet, random)
        self.sensed: list[Sensed] = []
        super().__init__(scenario, fleet.stations, self.late)

    def wait(self, timeout: float | None) -> Sequence[WorldEvent]:
        events = super().wait(timeout)
        self.sensed += [event for event in events if isinstance(event, Sensed)]
        return events
