"""Random small scenarios driven in the physics simulation with late messages, judged by the physics
alone.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from random import Random
from typing import Any

import yaml

from campaigns.drives.messages import Channel, Judge, LateTransport, PhysicsLog, channels, clocks
from safenav.errors import Diagnostic, InputError, UsageError
from safenav.fleet.driven import driven_motion
from safenav.fleet.file import load_fleet
from safenav.fleet.lab.physics import body_of
from safenav.fleet.transport import DriveRecording
from safenav.fleet.world import FleetWorld
from safenav.motion.check.verdict import check_motion
from safenav.motion.file import parsed, text_of
from safenav.run.checked import check_trace
from safenav.runtime.run.mission import Mission
from safenav.runtime.worlds.protocol import Sensed, WorldEvent
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace import records
from safenav.trace.file import TraceWriter, read_bytes
from support.examples import quiet
from support.missions import SIDES, mission

TOLD_OF_TRANSPORT = ("measured clock", "measured rate")
"""Rules of motions that say of a drive that its messages came late, or that clocks differ."""


def late_drive(seed: int) -> list[str]:
    """Drive a random mission; return the violated requirements. Raises InputError for a mission
    that is refused."""
    random, data = Random(f"drive {seed}"), late_mission(seed)
    hidden = data["obstacles"]
    if not any("from" in one for one in hidden):
        data["obstacles"] = []  # unknown to the team
    text = yaml.safe_dump(data, sort_keys=False)
    scenario = load_scenario_text(text, "late.yaml")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "fleet.yaml"
        path.write_text(yaml.safe_dump(fleet_of(random, hidden, scenario)))
        fleet = load_fleet(path, scenario)
    names = [robot.name for robot in scenario.robots]
    ways, watches = channels(random, names), clocks(random, names)
    for name, station in fleet.stations.items():
        if station.follow is not None:  # late odometry of a follower is a deviation
            ways[name, "odometry"] = Channel((0.0, 0.05))
    given = (scenario, fleet.stations, fleet.simulation, random, ways, watches)
    try:
        robots = LateTransport(*given)
    except UsageError as error:
        raise InputError([Diagnostic("late.yaml", 0, 0, str(error))]) from error
    recording, lines = DriveRecording(), list[records.Record]()
    world = FleetWorld(scenario, fleet.stations, robots, recording)
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
                listeners = [lines.append, writer, world.observe]
                mission = Mission(scenario, quiet(scenario), world=world, listeners=listeners)
                mission.run()
            content = path.read_bytes()
    finally:
        world.close()
    text_lines = content.decode().splitlines()
    judge = Judge(scenario, fleet.stations, world.goals.places, log, lines, sensed, mission.began)
    defects = judge.defects
    defects += [f"trace: {finding}" for finding in check_trace(text_lines).findings]
    trace = read_bytes(content, "late.jsonl")
    try:
        made = driven_motion(trace, world, fleet.stations, mission.began)
    except UsageError:  # a body that is too large for its regions
        return defects
    motion = parsed(text_of(made).encode(), "late.motion.jsonl")
    found = check_motion(motion, trace)
    follow = any(station.follow is not None for station in fleet.stations.values())
    excused = {*TOLD_OF_TRANSPORT, *(["tracking"] if follow else [])}
    for one in found:
        acts = one.rule == "measured room" and _acts(lines, one.robot, one.t)
        if one.rule not in excused and not acts:
            defects.append(f"motion: {one}")
    return defects


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


# Random small scenarios for drives, and their fleets.


Data = dict[str, Any]


def late_mission(seed: int) -> Data:
    """A mixed mission for a drive: on a real clock, all obstacles with bodies of one type, which
    the lidars see."""
    random = Random(f"late {seed}")
    if random.random() < 0.5:
        return _rooms(random)
    data = mission("metric", seed)
    data["clock"] = "live"
    data["limits"] = {"ticks": 300, "synthesis_seconds": 20, "seconds": 240}
    for key in ("by", "within"):
        data["until"].pop(key, None)
    data.pop("late", None)
    for robot in data["robots"].values():
        robot["objective"].pop("within", None)
        robot.pop("avoids", None)  # bodies do not share a region
    types, solid = data["catalogue"]["obstacles"], None
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


def fleet_of(random: Random, hidden: list[Data], scenario: Scenario) -> Data:
    """The fleet of a scenario's robots in simulation. ``hidden``: the obstacles that are there."""
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
            own["scan"] = {"obstacle": solid[0]}
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
