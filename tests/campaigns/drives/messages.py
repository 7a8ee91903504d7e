"""The simulation behind a transport with late messages.

Each kind of message of each robot has its own channel, which keeps the order and has its own
delays. Robots' clocks differ in offset and speed, and may be set.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterator, Mapping
from itertools import count
from math import tau
from random import Random
from typing import Any

from msgspec import Struct

from fleet.lab import watched
from safenav.fleet import transport
from safenav.fleet.file import SimulationUse, Station
from safenav.fleet.lab.simulation import SimulationTransport
from safenav.runtime.worlds.protocol import Sensed
from safenav.scenario.model import Scenario
from safenav.trace import records
from safenav.trace.vocabulary import ActResult, MoveEnd

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


# A judge of drives by the physics: sightings, ends of steps and contacts. The check of motions
# judges the regions in which robots are.


class Moment(Struct):
    """The physics at a time: positions of robots, obstacles that stand, new contacts, acting
    robots."""

    t: float
    at: dict[str, tuple[float, float, float]]
    stands: frozenset[str]
    touches: tuple[tuple[str, str], ...]
    acting: frozenset[str]


class PhysicsLog:
    """The log of the physics, independent of the run."""

    def __init__(self, late: LateTransport) -> None:
        self._late = late
        self.moments: list[Moment] = []
        self._contacts: dict[tuple[str, str], int] = {}
        late.watch = self.note
        watched(late.physics)

    def note(self) -> None:
        """Keep the present moment."""
        physics: Any = self._late.physics
        bodies = physics._bodies
        new = tuple(k for k, n in physics.contacts.items() if n > self._contacts.get(k, 0))
        self._contacts = dict(physics.contacts)
        acting = frozenset(n for n, b in bodies.items() if b.acts is not None)
        at = {name: physics._at(body) for name, body in bodies.items()}
        stands = frozenset(physics.standing)
        self.moments.append(Moment(physics.now, at, stands, new, acting))


def close_to(places: Any, region: int, at: tuple[float, float, float]) -> float:
    """Metres from a region's middle."""
    return float(places.distance(region, at[0], at[1]))


class Judge:
    """Compares a trace with the log of the physics."""

    def __init__(
        self,
        scenario: Scenario,
        stations: Mapping[str, Station],
        places: Any,
        log: PhysicsLog,
        lines: list[records.Record],
        sensed: list[Sensed],
        zero: float,
    ) -> None:
        self._scenario, self._stations, self._places = scenario, stations, places
        self._log, self._lines, self._zero = log.moments, lines, zero
        self._sensed = sensed
        self.defects: list[str] = []
        self._sightings()
        self._ends()
        self._contacts()

    def _wrong(self, t: float, what: str) -> None:
        self.defects.append(f"{t:.2f} s: {what}")

    def _once(self, t: float, what: str) -> None:
        if not any(what in told for told in self.defects):
            self._wrong(t, what)

    def _known(self, obstacle: str, t: float) -> bool:
        """Return whether an obstacle was discovered before: then only a robot that resolves it may
        enter."""
        return any(
            event.obstacle.name == obstacle and event.at - self._zero < t
            for event in self._sensed
            if event.there
        )

    def _around(self, t: float, before: float, after: float = 0.05) -> Iterator[Moment]:
        at = t + self._zero
        return (one for one in self._log if at - before <= one.t <= at + after)

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

    def _ends(self) -> None:
        """Check that each step ends where the trace says."""
        for line in self._lines:
            if not isinstance(line, records.Arrive) or self._bumped(line.robot, line.t or 0.0):
                continue
            t, name = line.t or 0.0, line.robot
            now = [*self._around(t, 0.05)][-1].at[name]
            here = self._places.region(now[0], now[1])
            if line.result is MoveEnd.LOST:
                if here not in (line.regions or ()):
                    self._wrong(t, f"{name} is in {here}, not lost in {line.regions}")
                continue
            far = close_to(self._places, line.at, now)
            if here != line.at or far > self._limit(name):
                self._wrong(t, f"{name} {line.result} {far:.2f} m from the centre of {line.at}")
            if line.heading is not None:
                facing = self._places.heading(now[2]).label
                if facing != line.heading:
                    self._wrong(t, f"{name} {line.result}: faces {facing}, not {line.heading}")

    def _limit(self, name: str) -> float:
        station = self._stations[name]
        if station.follow is None:
            return station.tolerance + 0.05
        return float(max(self._places.frame.resolution)) / 2 + 0.05

    def _contacts(self) -> None:
        """Check that no robot touches another one, or an obstacle on which it does not act."""
        for one in self._log:
            for pair in one.touches:
                robots = [name for name in pair if name in one.at]
                t = one.t - self._zero
                if t < 0:
                    continue
                team = {robot.name: robot for robot in self._scenario.robots}
                if len(robots) == 2 and team[robots[0]].conflicts(team[robots[1]]):
                    self._once(t, f"{pair[0]} touches {pair[1]}")
                for thing in {*pair} - {*robots} - {"wall"}:
                    name = thing.split("~")[0]
                    acts = robots[0] in one.acting or any(
                        robots[0] in m.acting for m in self._around(t, 1.0)
                    )
                    if name in one.stands and not acts and not self._known(name, t):
                        self._once(t, f"{robots[0]} touches {thing}")

    def _bumped(self, name: str, t: float) -> bool:
        """Whether a robot touches another one, which the scenario lets share its regions."""
        pairs = (pair for one in self._around(t, 0.5) for pair in one.touches)
        return any(name in pair and all(one in self._log[0].at for one in pair) for pair in pairs)
