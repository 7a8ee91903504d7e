"""``safenav drive``: run a scenario with real robots, or rehearse that."""

from __future__ import annotations

import signal
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from safenav.cli.output import FILE

if TYPE_CHECKING:
    from safenav.fleet.fleet_file import FleetFile
    from safenav.fleet.world import FleetWorld
    from safenav.scenario.model import Scenario
    from safenav.trace.writing import Listener

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav new fleet.yaml --fleet lab.yaml
  safenav drive lab.yaml --fleet fleet.yaml --rehearse --trace lab.jsonl
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
@click.option("--rehearse", is_flag=True, help="Simulate the run in time; no robot moves.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON, not the events.")
@click.option(
    "--time-limit",
    type=click.FloatRange(min=0, min_open=True),
    help="Stop after this many seconds.",
)
@click.option(
    "--patience",
    type=click.FloatRange(min=0, min_open=True),
    default=10.0,
    show_default=True,
    help="Seconds in which each robot has to answer at the start.",
)
def command(
    scenario: Path,
    fleet: Path,
    trace: Path | None,
    rehearse: bool,
    as_json: bool,
    time_limit: float | None,
    patience: float,
) -> int:
    """Run SCENARIO with the robots of a fleet file. safenav decides where each robot goes next; the
    robots' own navigation drives them there."""
    from safenav.cli.run import interrupt, report, while_heard
    from safenav.fleet.fleet_file import load_fleet
    from safenav.report.terminal.story import Story
    from safenav.runtime.expectation import Ledger
    from safenav.runtime.mission import Mission, default_synthesizer
    from safenav.scenario.model import Clock
    from safenav.scenario.reading.loader import load_scenario
    from safenav.trace.writing import TraceWriter

    plan = replace(load_scenario(scenario), clock=Clock.LIVE)
    if time_limit is not None:
        plan = replace(plan, limits=replace(plan.limits, seconds=time_limit))
    stations = load_fleet(fleet, plan)
    ledger = Ledger()
    listeners: list[Listener] = [ledger]
    with ExitStack() as stack:
        if trace is not None:
            listeners.append(stack.enter_context(TraceWriter(trace)))
        if not as_json:
            listeners.append(while_heard(Story(plan)))
        world = None if rehearse else _connected(plan, stations, patience, stack)
        mission = Mission(plan, default_synthesizer(plan), world=world, listeners=listeners)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM):
            signal.signal(number, lambda number, _: interrupt(mission, number))
        mission.run()
        signal.setitimer(signal.ITIMER_REAL, 0)
        return report(mission, scenario, ledger, as_json, trace)


def _connected(plan: Scenario, fleet: FleetFile, patience: float, stack: ExitStack) -> FleetWorld:
    """The fleet behind its transport, where each robot has answered; closed with the stack."""
    from safenav.fleet.connecting import fleet_world

    world = fleet_world(plan, fleet)
    stack.callback(world.close)
    world.open(patience)
    return world
