"""``safenav drive``: run a scenario with real robots, or rehearse that."""

from __future__ import annotations

import signal
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click
from msgspec.structs import replace

from safenav.cli import options
from safenav.cli.output import FILE

if TYPE_CHECKING:
    from safenav.fleet.fleet_file import FleetFile
    from safenav.fleet.recording import DriveRecording
    from safenav.fleet.world import FleetWorld
    from safenav.runtime.mission import Mission
    from safenav.scenario.model import Scenario
    from safenav.studio.watching import LiveView
    from safenav.trace.writing import Listener

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav new fleet.yaml --fleet lab.yaml
  safenav drive lab.yaml --fleet fleet.yaml --rehearse --trace lab.jsonl
  safenav drive lab.yaml --fleet fleet.yaml --live   # extra 'studio'
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
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option(
    "--fleet",
    type=click.Path(path_type=Path),
    required=True,
    help="How each robot is reached, senses and acts (docs/drive.md).",
)
@click.option("--trace", type=FILE, help="Write the trace (JSON Lines).")
@click.option(
    "--motion", type=FILE, help="Write what was sent and measured in metres (extra: motion)."
)
@click.option("--rehearse", is_flag=True, help="Simulate the run in time; no robot moves.")
@click.option(
    "--operator",
    metavar="FILE",
    help="Where the run needs an operator, read interventions from this file (-: ask here).",
)
@options.live
@options.result_as_json
@click.option(
    "--time-limit",
    type=options.SECONDS,
    help="Stop after this many seconds.",
)
@click.option(
    "--patience",
    type=options.SECONDS,
    default=10.0,
    show_default=True,
    help="Seconds in which each robot has to answer at the start.",
)
def command(
    scenario: Path,
    fleet: Path,
    trace: Path | None,
    motion: Path | None,
    rehearse: bool,
    operator: str | None,
    live: bool,
    as_json: bool,
    time_limit: float | None,
    patience: float,
) -> int:
    """Run SCENARIO with the robots of a fleet file. safenav decides where each robot goes next; the
    robots' own navigation drives them there."""
    from safenav.cli.operator import run_with_operator
    from safenav.cli.run import attendant, interrupt, report, while_heard
    from safenav.fleet.fleet_file import load_fleet
    from safenav.fleet.recording import DriveRecording
    from safenav.outfile import try_out
    from safenav.report.terminal.story import Story
    from safenav.runtime.analysis.expectation import Ledger
    from safenav.runtime.mission import Mission, default_synthesizer
    from safenav.scenario.lint import oversized
    from safenav.scenario.reading.loader import load_scenario
    from safenav.scenario.settings import Clock
    from safenav.trace.writing import TraceWriter, next_part

    plan = replace(load_scenario(scenario), clock=Clock.LIVE)
    if time_limit is not None:
        plan = replace(plan, limits=replace(plan.limits, seconds=time_limit))
    if motion is not None and rehearse:
        raise click.UsageError("--motion: no robot moves in a rehearsal; use safenav motion")
    stations = load_fleet(fleet, plan)
    for warning in (*plan.map.notes, *oversized(plan)):
        click.echo(f"warning: {warning}", err=True)
    recording = None if motion is None else DriveRecording()
    kept = trace
    operator = attendant(operator, True, as_json)
    ledger = Ledger()
    listeners: list[Listener] = [ledger]
    with ExitStack() as watched:
        view = watched.enter_context(_view(plan)) if live else None
        if view is not None:
            click.echo(f"live: {view.address}", err=True)
        with ExitStack() as stack:
            if motion is not None and trace is None:
                from tempfile import TemporaryDirectory

                folder = watched.enter_context(TemporaryDirectory())
                trace = Path(folder) / f"{scenario.stem}.jsonl"
            if trace is not None:
                try_out(trace)
            connection = stack.enter_context(ExitStack())
            world = (
                None if rehearse else _connected(plan, stations, patience, connection, recording)
            )
            if trace is not None:
                listeners.append(stack.enter_context(TraceWriter(trace)))
            if not as_json:
                listeners.append(while_heard(Story(plan)))
            if view is not None:
                listeners.append(view)
            if world is not None:
                listeners.append(world.told)
            mission = Mission(
                plan,
                default_synthesizer(plan),
                world=world,
                listeners=listeners,
                attended=operator is not None,
            )

            def another(rest: Scenario) -> Mission:
                """The mission that continues with a robot more, and has a trace of its own."""
                nonlocal mission, trace, kept
                robots = load_fleet(fleet, rest)
                connection.close()
                told: list[Listener] = [ledger]
                if trace is not None:
                    trace = next_part(trace)
                    kept = kept and trace
                    told.append(stack.enter_context(TraceWriter(trace)))
                if not as_json:
                    told.append(while_heard(Story(rest)))
                told += [view] if view is not None else []
                driven = None if rehearse else _connected(rest, robots, patience, connection, None)
                told += [driven.told] if driven is not None else []
                made = default_synthesizer(rest)
                mission = Mission(rest, made, world=driven, listeners=told, attended=True)
                return mission

            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM):
                signal.signal(number, lambda number, _: interrupt(mission, number))
            if operator is None:
                mission.run()
            else:
                joins = another if motion is None else None  # one file of motion, one run
                run_with_operator(mission, operator, helping=not as_json, another=joins)
            signal.setitimer(signal.ITIMER_REAL, 0)
        if motion is not None and trace is not None and world is not None:
            _write_motion(motion, trace, world, mission, stations)
        status = report(mission, scenario, ledger, as_json, kept)
        if view is not None:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            view.wait()
    return status


def _view(plan: Scenario) -> LiveView:
    """The page of the run."""
    from safenav.studio.watching import LiveView

    return LiveView(plan)


def _connected(
    plan: Scenario,
    fleet: FleetFile,
    patience: float,
    stack: ExitStack,
    recording: DriveRecording | None,
) -> FleetWorld:
    """The fleet behind its transport, where each robot has answered; closed with the stack."""
    from safenav.fleet.connecting import fleet_world

    world = fleet_world(plan, fleet, recording)
    stack.callback(world.close)
    world.open(patience)
    return world


def _write_motion(
    motion: Path, trace: Path, world: FleetWorld, mission: Mission, fleet: FleetFile
) -> None:
    from safenav.fleet.driven import driven_motion
    from safenav.motion.file.writing import text_of
    from safenav.outfile import write_bytes
    from safenav.trace.reading import read_trace

    made = driven_motion(read_trace(trace), world, fleet.stations, mission.began)
    write_bytes(motion, text_of(made).encode())
