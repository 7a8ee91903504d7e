"""Random small scenarios driven in the physics simulation with late messages, judged by the physics
alone.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from random import Random

import yaml

from campaigns.drives.messages import Channel, LateTransport, channels, clocks
from campaigns.drives.physics_judge import Judge, PhysicsLog
from campaigns.drives.rooms import fleet_of, late_mission
from safenav.checked_trace import check_trace
from safenav.errors import Diagnostic, InputError, UsageError
from safenav.fleet.driven import driven_motion
from safenav.fleet.file import load_fleet
from safenav.fleet.transport import DriveRecording
from safenav.fleet.world import FleetWorld
from safenav.motion.check.verdict import check_motion
from safenav.motion.file import parsed, text_of
from safenav.runtime.run.mission import Mission
from safenav.runtime.worlds.protocol import Sensed, WorldEvent
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace import records
from safenav.trace.file import TraceWriter, read_bytes
from support.examples import quiet

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
