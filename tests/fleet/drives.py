"""Drives of the simulation in this process, with their trace and motion."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path

from msgspec.structs import replace

from once import beside
from safenav.fleet.driven import driven_motion
from safenav.fleet.file import Station, load_fleet
from safenav.fleet.transport import DriveRecording
from safenav.fleet.world import FleetWorld, fleet_world
from safenav.motion.check.examination import Finding
from safenav.motion.check.verdict import check_motion
from safenav.motion.file import Motion, parsed, text_of
from safenav.runtime.run.mission import Mission
from safenav.scenario.model import Clock, Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.trace.file import Listener, Trace, TraceWriter, read_bytes

HALL = beside(__file__, "scenarios/hall.yaml")
FLEET = beside(__file__, "scenarios/hall.fleet.yaml")


@cache
def driven(
    scenario: str = HALL,
    fleet: str = FLEET,
    goals: tuple[str, ...] = (),
    listeners: tuple[Listener, ...] = (),
) -> Drive:
    """A drive of a scenario; ``goals``: robots that get goals although the defaults follow."""
    plan = replace(load_scenario_text(scenario, "made.yaml"), clock=Clock.LIVE)
    with tempfile.TemporaryDirectory() as folder:
        written, path = Path(folder) / "fleet.yaml", Path(folder) / "trace.jsonl"
        written.write_text(fleet)
        given = load_fleet(written, plan)
        stations = {
            name: replace(station, follow=None) if name in goals else station
            for name, station in given.stations.items()
        }
        world = fleet_world(plan, replace(given, stations=stations), DriveRecording())
        return drive_in(world, plan, stations, path, listeners)


def drive_in(
    world: FleetWorld,
    plan: Scenario,
    stations: Mapping[str, Station],
    path: Path,
    listeners: Iterable[Listener] = (),
) -> Drive:
    """A drive in a world that records it; ``path``: its trace."""
    try:
        world.open()
        with TraceWriter(path) as writer:
            mission = Mission(plan, world=world, listeners=[*listeners, writer, world.observe])
            mission.run()
    finally:
        world.close()
    content = path.read_bytes()
    trace = read_bytes(content, "made.jsonl")
    made = driven_motion(trace, world, stations, mission.began)
    return Drive(content, trace, parsed(text_of(made).encode(), "made.motion.jsonl"))


class Drive:
    """A trace, its sum, and the motion of the drive as a reader of its file has it."""

    def __init__(self, content: bytes, trace: Trace, motion: Motion) -> None:
        self.lines = content.decode().splitlines()
        self.trace, self.motion = trace, motion

    def judged(self, motion: Motion | None = None) -> list[Finding]:
        return check_motion(motion or self.motion, self.trace)
