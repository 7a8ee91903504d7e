"""The simulation behind a transport with late messages.

Each kind of message of each robot has its own channel, which keeps the order and has its own
delays. Robots' clocks differ in offset and speed, and may be set.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Mapping
from itertools import count
from math import tau
from random import Random
from typing import Any

from msgspec import Struct

from safenav.fleet import transport
from safenav.fleet.file import SimulationUse, Station
from safenav.fleet.lab.simulation import SimulationTransport
from safenav.scenario.model import Scenario
from safenav.trace.vocabulary import ActResult

MOST = 1.5
"""Seconds by which a message comes late at most."""
KINDS = {
    transport.Located: "odometry",
    transport.Scanned: "scan",
    transport.Reported: "report",
    transport.GoalEnded: "goal",
    transport.Performed: "action",
}


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


class RobotClock(Struct):
    """A robot's own clock: ``offset`` seconds ahead, with relative speed ``speed``; at ``set_at``
    it is set back by ``back`` seconds."""

    offset: float = 0.0
    speed: float = 1.0
    set_at: float = 1e9
    back: float = 0.0

    def stamp(self, now: float) -> float:
        return self.offset + self.speed * now - self.back * (now >= self.set_at)


class LateTransport(SimulationTransport):
    """The simulation, heard late. Lidars also look while their robot moves."""

    def __init__(
        self,
        scenario: Scenario,
        stations: Mapping[str, Station],
        use: SimulationUse,
        random: Random,
        channels: Mapping[tuple[str, str], Channel],
        clocks: Mapping[str, RobotClock],
    ) -> None:
        super().__init__(scenario, stations, use)
        self._random, self._channels, self._clocks = random, channels, clocks
        self._sent: list[tuple[float, int, transport.Message]] = []
        self._numbers = count()
        self.watch: Callable[[], None] = lambda: None

    def step(self) -> None:
        self._due = 0.0
        super().step()
        self.watch()
        while self._sent and self._sent[0][0] <= self.physics.now:
            self._post(heapq.heappop(self._sent)[2])

    def _send(self, name: str, message: transport.Message) -> None:
        now = self.physics.now
        channel = self._channels[name, KINDS[type(message)]]
        for _ in range(1 + (channel.twice and self._random.random() < 0.3)):
            at = channel.comes(now, self._random)
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


def channels(random: Random, names: list[str]) -> dict[tuple[str, str], Channel]:
    """Return the channels of a drive, each with random delays."""
    kind = random.choice(["steady", "random", "random", "bursts", "mixed", "mixed", "mixed"])
    found = {}
    for name in names:
        for channel in KINDS.values():
            how = random.choice(["none", "steady", "random", "bursts"]) if kind == "mixed" else kind
            least = random.choice([0.0, 0.3, random.uniform(0.0, MOST)])
            late = {
                "none": (0.0, 0.0),
                "steady": (least, least),
                "random": (0.0, random.choice([0.3, MOST])),
                "bursts": (0.0, 0.0),
            }[how]
            made = Channel(late, burst=random.uniform(0.2, MOST) if how == "bursts" else 0.0)
            if channel == "odometry" and how in ("none", "random"):
                made.drops = random.choice([0.0, 0.0, 0.3])
            if channel in ("goal", "action", "report"):
                made.twice = random.random() < 0.3
            found[name, channel] = made
    return found


def clocks(random: Random, names: list[str]) -> dict[str, RobotClock]:
    """The robots' own clocks."""
    found = {}
    for name in names:
        one = RobotClock(random.choice([0.0, 0.0, random.uniform(-1e4, 1e4)]))
        if random.random() < 0.2:
            one.speed = random.choice([0.2, 5.0])
        if random.random() < 0.25:
            one.set_at, one.back = random.uniform(2, 40), random.choice([0.4, 3.0, 3600.0, -3600.0])
        found[name] = one
    return found
