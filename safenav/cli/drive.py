"""``safenav drive``: run a scenario with real robots, or rehearse the run."""

from __future__ import annotations

import signal
from contextlib import ExitStack
from pathlib import Path

import click
from msgspec.structs import replace

from safenav.cli import options, warn
from safenav.cli.run_session import RunSession, attendant, limited
from safenav.errors import UsageError
from safenav.fleet.acting import unserved
from safenav.fleet.connection import fleet_world
from safenav.fleet.fleet_file import load_fleet
from safenav.fleet.stations import FleetFile
from safenav.fleet.transport import DriveRecording
from safenav.fleet.world import FleetWorld
from safenav.outfile import write_out
from safenav.runtime.run.checkpoint import resumption
from safenav.runtime.run.mission import Mission, default_synthesizer
from safenav.scenario.lint import imprecise, oversized
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.settings import Clock
from safenav.trace.reading import read_trace
from safenav.trace.writing import Listener

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav new fleet.yaml --fleet lab.yaml
  safenav drive lab.yaml --fleet fleet.yaml --rehearse --trace lab.jsonl
  safenav drive lab.yaml --fleet fleet.yaml --live   # extra 'studio'
  head -120 lab.jsonl > part.jsonl                   # as if that drive had been killed
  safenav drive lab.yaml --fleet fleet.yaml --rehearse --resume part.jsonl --trace b.jsonl
Without --rehearse the robots of the fleet file move.
\b
Ctrl-C stops all robots, then ends the run; a second one ends it immediately.
\b
Exit codes:
  0  the run ended as the scenario expects (without 'expect': completed)
  1  operator needed, unrealizable, or not as expected
  2  bad input, or robots that do not answer   3  tick, time or memory limit
  4  internal error   130  interrupted
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=options.INPUT)
@click.option(
    "--fleet",
    type=options.INPUT,
    required=True,
    help="How each robot is reached, senses and acts (docs/drive.md).",
)
@options.trace
@click.option(
    "--motion",
    type=options.LINES,
    help="Write the motion commanded and measured, in metres (extra: motion).",
)
@click.option("--rehearse", is_flag=True, help="Simulate the run; no robot moves.")
@click.option(
    "--resume",
    "begun",
    type=options.INPUT,
    metavar="TRACE",
    help="Continue an interrupted drive of SCENARIO from its last checkpoint.",
)
@options.operator
@options.live
@options.result_as_json
@click.option("--time-limit", type=options.SECONDS, help="Stop after this many seconds.")
@click.option(
    "--patience",
    type=options.SECONDS,
    default=10.0,
    show_default=True,
    help="Seconds that each robot has to answer at the start.",
)
def command(
    scenario: Path,
    fleet: Path,
    trace: Path | None,
    motion: Path | None,
    rehearse: bool,
    begun: Path | None,
    operator: str | None,
    live: bool,
    as_json: bool,
    time_limit: float | None,
    patience: float,
) -> int:
    """Run SCENARIO with the robots of a fleet file. safenav decides where each robot goes next; the
    robots' own navigation drives them there."""
    plan = load_scenario(scenario)
    plan = limited(replace(plan, clock=Clock.LIVE), None, time_limit)
    first = None if begun is None else resumption(read_trace(begun), plan)
    if motion is not None and rehearse:
        hint = "use safenav export TRACE --motion FILE"
        raise UsageError(f"--motion: no robot moves in a rehearsal\n    {hint}")
    stations = load_fleet(fleet, plan)
    _warn(plan, stations)
    recording = None
    if motion is not None:
        from safenav.motion.making import check_movable

        check_movable(plan)  # before a robot moves, not when the file is written
        recording = DriveRecording()
    operator = attendant(operator, True, as_json)
    world = None

    def mission(plan: Scenario, listeners: list[Listener]) -> Mission:
        """Return the mission, for real robots once each of them has answered."""
        nonlocal world
        robots = load_fleet(fleet, plan)
        plan = replace(plan, failures=robots.failures)
        connection.close()
        if not rehearse:
            world = fleet_world(plan, robots, recording)
            connection.callback(world.close)
            world.open(patience)
            listeners = [*listeners, world.observe]
        synthesizer = default_synthesizer(plan)
        attended = operator is not None
        return Mission(
            plan,
            synthesizer,
            world=world,
            listeners=listeners,
            attended=attended,
            begun=first,
            checkpoints=True,
        )

    with ExitStack() as stack:
        view = None
        if live:
            from safenav.studio.watching import LiveView

            view = stack.enter_context(LiveView(plan))
            click.echo(f"live: {view.address}", err=True)
        connection = stack.enter_context(ExitStack())
        run = RunSession(
            mission,
            stack,
            trace,
            temporary=None if motion is None else f"{scenario.stem}.jsonl",
            as_json=as_json,
            views=() if view is None else (view,),
        )
        run.begin(plan)
        run.run(operator)
        connection.close()
        if motion is not None and run.trace is not None and world is not None:
            _write_motion(motion, run.trace, world, stations, run.mission.began)
        status = run.report(scenario)
        if view is not None:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            view.wait()
    return status


def _write_motion(
    file: Path, trace: Path, world: FleetWorld, fleet: FleetFile, began: float
) -> None:
    from safenav.fleet.driven import driven_motion
    from safenav.motion.file.reading import text_of

    write_out(file, text_of(driven_motion(read_trace(trace), world, fleet.stations, began)))


def _warn(plan: Scenario, fleet: FleetFile) -> None:
    """Warn of robots without room or precision, and of obstacles that the fleet cannot resolve."""
    tolerances = {
        name: station.tolerance if station.follow is None else station.follow.tolerance
        for name, station in fleet.stations.items()
    }
    sizes = (*oversized(plan), *imprecise(plan, tolerances))
    for warning in (*plan.map.notes, *sizes, *unserved(plan, fleet)):
        warn(warning)
