"""Random small scenarios driven in physics behind a transport whose messages come late, and a judge
that reads only the physics.

Each kind of message of each robot is a channel of its own: it keeps its order and is as late as it
likes. Robots' clocks differ, run at other speeds, and may be set.
"""

from __future__ import annotations

import heapq
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import count
from math import hypot, tau
from pathlib import Path
from random import Random
from typing import Any

import yaml
from msgspec import Struct

from fuzz.mixed import SIDES, metric_mission
from fuzz.test_missions import quiet
from safenav.audit.check import check_trace
from safenav.errors import InputError, UsageError
from safenav.fleet import transport
from safenav.fleet.driven import driven_motion
from safenav.fleet.fleet_file import SimulationUse, Station, load_fleet
from safenav.fleet.lab_model import body_of
from safenav.fleet.simulation import SimulationTransport
from safenav.fleet.steps import FleetClock
from safenav.fleet.transport import DriveRecording
from safenav.fleet.world import FleetWorld
from safenav.motion.check.verdict import check_motion
from safenav.motion.file.reading import parsed, text_of
from safenav.runtime.mission import Mission
from safenav.runtime.worlds.protocol import Sensed, WorldEvent
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace import records
from safenav.trace.reading import read_bytes
from safenav.trace.vocabulary import ActResult, MoveEnd
from safenav.trace.writing import TraceWriter

Data = dict[str, Any]

MOST = 1.5
"""Seconds by which a message comes late at most."""
TOLD_OF_TRANSPORT = ("measured clock", "measured rate")
"""Rules of check-motion that say of a drive that its messages came late, or that clocks differ."""
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
        """When a message that is sent now comes; None: never."""
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
    """A robot's own clock: ``offset`` seconds ahead, as fast as ``speed``; from ``set_at`` on it is
    set ``back`` seconds."""

    offset: float = 0.0
    speed: float = 1.0
    set_at: float = 1e9
    back: float = 0.0

    def stamp(self, now: float) -> float:
        return self.offset + self.speed * now - self.back * (now >= self.set_at)


class Hand(Struct):
    """A person who carries a robot that stands to a region beside it, ``at`` some time."""

    robot: str
    at: float
    to: tuple[float, float] | None = None


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
        hand: Hand | None = None,
    ) -> None:
        super().__init__(scenario, stations, use)
        self._hand, self._world = hand, scenario.map
        self._random, self._channels, self._clocks = random, channels, clocks
        self._sent: list[tuple[float, int, transport.Message]] = []
        self._numbers = count()
        self.watch: Callable[[], None] = lambda: None

    def step(self) -> None:
        self._due = 0.0
        super().step()
        if self._hand is not None and self.physics.now >= self._hand.at:
            self._carry(self._hand)
        self.watch()
        while self._sent and self._sent[0][0] <= self.physics.now:
            self._post(heapq.heappop(self._sent)[2])

    def _carry(self, hand: Hand) -> None:
        physics, places = self.physics, self.physics._places
        body = physics._bodies[hand.robot]
        x, y, _ = physics._at(body)
        if hand.to is None:
            here = places.region(x, y)
            free = (
                [] if here is None or physics._moves(hand.robot) else self._world.neighbours(here)
            )
            free = [r for r in free if not physics._busy(r)]
            free = [r for r in free if all(o.region != r for o in physics._obstacles)]
            if body.acts is not None or not free:
                return
            hand.to = places.centre(self._random.choice(free))
        far = hypot(hand.to[0] - x, hand.to[1] - y)
        if far < 0.05:
            self._hand = None
        share = min(1.0, 0.02 / max(far, 1e-9))
        body.stay = x + share * (hand.to[0] - x), y + share * (hand.to[1] - y)
        for dof, value in zip(body.dofs[:2], body.stay, strict=True):
            physics._data.qpos[dof] = value

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
        if state["goal"] is None and self._stations[name].report is not None:
            for found in self.physics.noticed(name):
                self._send(name, transport.Reported(name, found))


AJAR = 0.9
"""Radians of a leaf from which on a lidar may look past it."""


class Moment(Struct):
    """The physics at a time: where robots are, what stands (a door that is not wide open, or that
    is shut), what is new in contact, who acts."""

    t: float
    at: dict[str, tuple[float, float, float]]
    stands: dict[str, bool]
    shut: frozenset[str]
    touches: tuple[tuple[str, str], ...]
    acting: frozenset[str]


class PhysicsLog:
    """What was so, from the physics alone."""

    def __init__(self, late: LateTransport) -> None:
        self._late = late
        self.moments: list[Moment] = []
        self._contacts: dict[tuple[str, str], int] = {}
        late.watch = self.note

    def note(self) -> None:
        """Keep the present moment."""
        physics = self._late.physics
        bodies = physics._bodies
        new = tuple(k for k, n in physics.contacts.items() if n > self._contacts.get(k, 0))
        self._contacts = dict(physics.contacts)
        standing = physics._obstacles.now
        stands = {n: not (one.is_door and physics._is_open(one)) for n, one in standing.items()}
        shut = frozenset(
            name
            for name, one in standing.items()
            if not one.is_door
            or all(abs(float(physics._data.qpos[j])) < AJAR for j in physics._leaves[one.key])
        )
        acting = frozenset(n for n, b in bodies.items() if b.acts is not None)
        at = {name: physics._at(body) for name, body in bodies.items()}
        self.moments.append(Moment(physics.now, at, stands, shut, new, acting))


def close_to(places: Any, region: int, at: tuple[float, float, float]) -> float:
    """Metres from a region's middle."""
    return float(places.distance(region, at[0], at[1]))


class Judge:
    """Compares a trace with the log of the physics. ``moved``: robots that a person moves by hand,
    and from when on, in seconds."""

    def __init__(
        self,
        scenario: Scenario,
        stations: Mapping[str, Station],
        places: Any,
        log: PhysicsLog,
        lines: list[records.Record],
        sensed: list[Sensed],
        zero: float,
        moved: Mapping[str, float],
    ) -> None:
        self._scenario, self._stations, self._places = scenario, stations, places
        self._log, self._lines, self._zero, self._moved = log.moments, lines, zero, moved
        self._sensed = sensed
        self.defects: list[str] = []
        self._sightings()
        self._ends()
        self._contacts()
        self._rooms()

    def _wrong(self, t: float, what: str) -> None:
        self.defects.append(f"{t:.2f} s: {what}")

    def _once(self, t: float, what: str) -> None:
        if not any(what in told for told in self.defects):
            self._wrong(t, what)

    def _known(self, obstacle: str, t: float) -> bool:
        """Whether it was discovered before: nobody enters then but who is to resolve it there."""
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
            stood = [bool(one.stands.get(name)) for one in self._around(t, 3.0)]
            if event.there and any(self._carried(one, event, t) for one in self._moved):
                continue
            if event.there and not any(stood):
                self._wrong(t, f"{event.by} has not seen {name}")
            elif (
                not event.there
                and all(name in one.shut for one in self._around(t, 3.0))
                and not self._from_its_edge(event, t)
            ):
                self._wrong(t, f"{event.by} tells that {name} is gone")

    def _from_its_edge(self, event: Sensed, t: float) -> bool:
        """Whether a robot looks along the leaves of a door, which no ray may hit."""
        world, region = self._places.world, event.obstacle.region
        row, col = world.position(region)
        along = any(world.position(r)[0] == row for r in world.neighbours(region))
        x, y, _ = [*self._around(t, 0.05)][-1].at[event.by or ""]
        seen_from = world.position(self._places.region(x, y))
        pushed = any(need.action == "push" for need in event.obstacle.needs)
        return pushed and (seen_from[0] != row if along else seen_from[1] != col)

    def _ends(self) -> None:
        """A step ends where the trace has it end."""
        for line in self._lines:
            if not isinstance(line, records.Arrive) or self._by_hand(line.robot, line.t or 0.0):
                continue
            if self._bumped(line.robot, line.t or 0.0):
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
                self._wrong(t, f"{name} {line.result} {far:.2f} m from the middle of {line.at}")
            if line.heading is not None:
                facing = self._places.heading(now[2]).label
                if facing != line.heading:
                    self._wrong(t, f"{name} {line.result}: faces {facing}, not {line.heading}")

    def _limit(self, name: str) -> float:
        station = self._stations[name]
        if station.follow is None:
            return station.tolerance + 0.05
        return float(max(self._places.frame.resolution)) / 2 + 0.05

    def _carried(self, robot: str, event: Sensed, t: float) -> bool:
        """Whether a robot that somebody carries may have been taken for an obstacle."""
        region, reach = event.obstacle.region, max(self._places.frame.resolution) / 2
        ats = (one.at[robot] for one in self._around(t, 3.0))
        return self._by_hand(robot, t) and any(
            self._places.outside(region, x, y) < reach for x, y, _ in ats
        )

    def _by_hand(self, name: str, t: float) -> bool:
        return self._moved.get(name, 1e9) <= t

    def _contacts(self) -> None:
        """No robot touches another one, or an obstacle on which it does not act."""
        for one in self._log:
            for pair in one.touches:
                robots = [name for name in pair if name in one.at]
                t = one.t - self._zero
                if t < 0 or any(self._by_hand(name, t) for name in robots):
                    continue
                team = {robot.name: robot for robot in self._scenario.robots}
                if len(robots) == 2 and self._scenario.conflict(*(team[n] for n in robots)):
                    self._once(t, f"{pair[0]} touches {pair[1]}")
                for thing in {*pair} - {*robots} - {"wall"}:
                    name = thing.split("~")[0]
                    acts = robots[0] in one.acting or any(
                        robots[0] in m.acting for m in self._around(t, 1.0)
                    )
                    if one.stands.get(name) and not acts and not self._known(name, t):
                        self._once(t, f"{robots[0]} touches {thing}")

    def _rooms(self) -> None:
        """A robot is in the regions that it has in the trace, and no two have one that conflict."""
        spans = self._spans()
        beyond: dict[str, float] = {}
        for one in self._log:
            t = one.t - self._zero
            if t < 0:
                continue
            for name, held in spans.items():
                regions = next((r for a, b, r in held if a <= t < b), frozenset())
                if not regions or self._by_hand(name, t) or self._bumped(name, t):
                    continue
                x, y, _ = one.at[name]
                off = min(self._places.outside(region, x, y) for region in regions)
                if off > max(0.02, beyond.get(name, 0.0)) and name not in one.acting:
                    beyond[name] = off
                    self._wrong(t, f"{name} is {off:.2f} m outside of {sorted(regions)}")

    def _bumped(self, name: str, t: float) -> bool:
        """Whether a robot touches another one, which the scenario lets share its regions."""
        pairs = (pair for one in self._around(t, 0.5) for pair in one.touches)
        return any(name in pair and all(one in self._log[0].at for one in pair) for pair in pairs)

    def _spans(self) -> dict[str, list[tuple[float, float, frozenset[int]]]]:
        found: dict[str, list[tuple[float, float, frozenset[int]]]] = {}
        for robot in self._scenario.robots:
            since, regions = 0.0, frozenset({robot.start.region})
            found[robot.name] = []
            for line in self._lines:
                t = line.t or 0.0
                if getattr(line, "robot", None) != robot.name:
                    continue
                if isinstance(line, records.Depart):
                    new = frozenset({line.from_, line.to})
                elif isinstance(line, records.Arrive):
                    new = frozenset(line.regions or (line.at,))
                elif isinstance(line, records.Operator) and line.region is not None:
                    new = frozenset({line.region})
                else:
                    continue
                found[robot.name].append((since, t, regions))
                since, regions = t, new
            found[robot.name].append((since, 1e9, regions))
        return found


def late_mission(seed: int) -> Data:
    """A mixed mission for a drive: on a real clock, all obstacles with bodies of one type, which
    the lidars see."""
    random = Random(f"late {seed}")
    if random.random() < 0.5:
        return _rooms(random)
    data = metric_mission(seed)
    data["clock"] = "live"
    data["limits"] = {"ticks": 300, "synthesis_seconds": 20, "seconds": 240}
    for key in ("by", "within"):
        data["until"].pop(key, None)
    for key in ("late", "suspects"):
        data.pop(key, None)
    for robot in data["robots"].values():
        robot["objective"].pop("within", None)
        robot.pop("avoids", None)  # bodies do not share a region
    types, solid = data["catalogue"]["obstacles"], None
    for made in types.values():  # a door is in a passage
        for need in (made, *made.get("needs", ())):
            if need.get("action") == "push":
                need["action"] = "clear"
    kept = []
    for obstacle in data["obstacles"]:
        obstacle.pop("resolve_within", None)
        kind = obstacle["type"]
        if not types[kind].get("has_truth"):
            solid = solid or kind
            obstacle["type"] = solid
        kept.append(obstacle)
    data["obstacles"] = kept
    data["map"].setdefault("resolution", random.choice(SIDES))
    return data


def _rooms(random: Random) -> Data:
    """Two or three rooms with doors between them, and robots that cross them."""
    rooms = random.choice([2, 2, 3])
    rows, door = random.choice([1, 2, 2, 3]), random.choice([1, 2])
    wide = [random.choice([1, 2, 3]) for _ in range(rooms)]
    lines = []
    doors = [random.randrange(rows) for _ in range(rooms - 1)]
    for row in range(rows):
        cells = "#"
        for index, width in enumerate(wide):
            cells += "." * width
            last = index == rooms - 1
            cells += "#" if last or doors[index] != row else "."
        lines.append(cells)
    cols = len(lines[0])
    grid = ["#" * cols, *lines, "#" * cols]
    free = [k for k, cell in enumerate("".join(grid)) if cell == "."]
    at, places = 1, []
    for index, width in enumerate(wide[:-1]):
        at += width
        places.append((1 + doors[index]) * cols + at)
        at += 1
    inside = [k for k in free if k not in places]
    robots: Data = {}
    kinds = ["jackal", "mir250", "spot", "digit", "quadcopter", "tugger"]
    count = min(random.choice([1, 2, 2, 3]), len(inside) - 1)
    starts = random.sample(inside, count)
    models: Data = {"tugger": {"mobility": "free", "layer": "ground", "capabilities": ["push"]}}
    models["tugger"] |= {"size": 0.5, "speed": 0.8}
    for k, start in enumerate(starts):
        kind = random.choice(kinds)
        aims = random.sample(inside, 2)
        goal: Data = random.choice([{"visit": aims}, {"visit": [aims[0]]}, {"cover": aims}])
        robots[f"r{k}"] = {"model": kind, "start": start, "objective": goal}
        if kind == "digit":
            robots[f"r{k}"]["heading"] = random.choice(["north", "east", "south", "west"])
    kind = random.choice(["door", "door", "door", "debris"])
    hidden = [{"type": kind, "region": p} for p in places if random.random() < 0.8]
    return {
        "safenav": 1,
        "map": {"grid": grid, "resolution": random.choice([1.8, 2.0, 2.4])},
        "catalogue": {"robots": models},
        "robots": robots,
        "obstacles": hidden[:door],
        "until": {"rounds": random.choice([1, 1, 2])},
        "limits": {"ticks": 300, "synthesis_seconds": 20, "seconds": 240},
        "clock": "live",
        "seed": 0,
    }


def channels(random: Random, names: list[str]) -> dict[tuple[str, str], Channel]:
    """The channels of a drive, each as late as it likes."""
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


class LateDrive(Struct):
    """A drive that is over. ``defects``: what must not be."""

    outcome: str
    explanation: str
    seconds: float
    lines: list[str]
    defects: list[str]


def late_drive(seed: int, *, late: bool = True) -> LateDrive | None:
    """Drive a random mission; None for one that is refused."""
    random, data = Random(f"drive {seed}"), late_mission(seed)
    hidden = data["obstacles"]
    if not any("from" in one or "sweeps" in one for one in hidden):
        data["obstacles"] = []  # nobody has told the team
    text = yaml.safe_dump(data, sort_keys=False)
    try:
        scenario = load_scenario_text(text, "late.yaml")
    except InputError:
        return None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fleet.yaml"
        path.write_text(yaml.safe_dump(_fleet(random, hidden, scenario)))
        fleet = load_fleet(path, scenario)
    names = [robot.name for robot in scenario.robots]
    ways, watches = channels(random, names), clocks(random, names)
    for name, station in fleet.stations.items():
        if station.follow is not None:  # late odometry of a follower is a deviation
            ways[name, "odometry"] = Channel((0.0, 0.05))
    if not late:
        ways, watches = {key: Channel() for key in ways}, {name: RobotClock() for name in names}
    hand = None
    if late and random.random() < 0.25:
        hand = Hand(random.choice(names), random.uniform(2, 30))
    given = (scenario, fleet.stations, fleet.simulation, random, ways, watches, hand)
    try:
        robots = LateTransport(*given)
    except UsageError:
        return None
    clock = FleetClock(lambda: robots.physics.now, robots.step)
    recording, lines = DriveRecording(), list[records.Record]()
    world = FleetWorld(scenario, fleet.stations, robots, clock, recording)
    log, sensed = PhysicsLog(robots), list[Sensed]()
    waits = world.wait

    def wait(timeout: float | None) -> Sequence[WorldEvent]:
        events = waits(timeout)
        sensed.extend(event for event in events if isinstance(event, Sensed))
        return events

    world.wait = wait  # type: ignore[method-assign]
    try:
        world.open()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "trace.jsonl"
            with TraceWriter(path) as writer:
                listeners = [lines.append, writer, world.told]
                mission = Mission(scenario, quiet(scenario), world=world, listeners=listeners)
                result = mission.run()
            content = path.read_bytes()
    finally:
        world.close()
    text_lines = content.decode().splitlines()
    moved = {} if hand is None or hand.to is None else {hand.robot: hand.at - mission.began}
    judge = Judge(scenario, fleet.stations, world.places, log, lines, sensed, mission.began, moved)
    defects = judge.defects
    defects += [f"check-trace: {finding}" for finding in check_trace(text_lines).findings]
    trace = read_bytes(content, "late.jsonl")
    try:
        made = driven_motion(trace, world, fleet.stations, mission.began)
    except UsageError:  # a body that is too large for its regions
        return None
    motion = parsed(text_of(made).encode(), "late.motion.jsonl")
    found = check_motion(motion, trace)
    follow = any(station.follow is not None for station in fleet.stations.values())
    excused = {*TOLD_OF_TRANSPORT, *(["tracking"] if follow else [])}
    for one in found:
        acts = one.rule == "measured room" and _acts(lines, one.robot, one.t)
        if one.rule not in excused and not acts and moved.get(one.robot, 1e9) > one.t:
            defects.append(f"check-motion: {one}")
    said = str(result.explanation or "")
    return LateDrive(result.outcome.value, said, lines[-1].t or 0.0, text_lines, defects)


def _acts(lines: list[records.Record], robot: str, t: float) -> bool:
    """Whether a robot acts then: it reaches beyond its region."""
    begun: dict[int, float] = {}
    for line in lines:
        if isinstance(line, records.Act) and robot in line.robots:
            begun[line.command] = line.t or 0.0
        elif isinstance(line, records.ActionEnd):
            since = begun.pop(line.command, t + 1.0)
            if since <= t <= (line.t or 0.0):
                return True
    return False


def _fleet(random: Random, hidden: list[Data], scenario: Scenario) -> Data:
    side = min(scenario.map.frame.resolution) if scenario.map.frame is not None else 1.0
    kinds = scenario.catalogue.obstacles
    solid = [one["type"] for one in hidden if not kinds[one["type"]].has_truth]
    robots: Data = {}
    for robot in scenario.robots:
        wide = body_of(robot).radius * 2
        own: Data = {
            "act": {action: action for action in sorted(robot.capabilities)},
            "speed": robot.model.speed or 0.5,
            "tolerance": round(min(0.3, max(0.06, (side - wide) / 2)), 3),
        }
        if solid:
            own["scan"] = {"obstacle": solid[0], "beyond": round(0.3 * side, 2)}
        robots[robot.name] = own
    made: Data = {
        "safenav-fleet": 1,
        "transport": "simulation",
        "simulation": {"pace": 1e9} | ({} if scenario.obstacles else {"obstacles": hidden}),
        "defaults": {"timeout": random.choice([3, 6]), "report": "obstacles"},
        "robots": robots,
    }
    if random.random() < 0.2:
        made["defaults"]["follow"] = {}
    return made
