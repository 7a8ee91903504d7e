"""``safenav run``, ``resume`` and ``drive``: run a scenario, or the rest of a run."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click
from msgspec.structs import replace

from safenav.cli import options, warn
from safenav.cli.session import Files, attendant, carried_out, limited
from safenav.errors import ExitCode, UsageError
from safenav.files import write_out
from safenav.report.terminal.layout import WaitingLine
from safenav.runtime.run.mission import Mission, default_synthesizer
from safenav.scenario.model import Clock, Scenario
from safenav.scenario.reading.loader import load_scenario

if TYPE_CHECKING:
    from safenav.fleet.world import FleetWorld
    from safenav.runtime.run.checkpoint import Resumption
    from safenav.trace.file import Listener, Trace

RUN_EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml
  safenav run lab.yaml --html lab.html --trace lab.jsonl
  safenav run lab.yaml --motion lab.motion.jsonl # extra 'motion'
  safenav run lab.yaml --live
  safenav run lab.yaml --clock live              # robots move at the same time
  echo give_up > fixes.txt && safenav run lab.yaml --clock live --operator fixes.txt
\b
Exit codes:
  0  the run ended as the scenario expects (without 'expect': completed)
  1  operator needed, unrealizable, or not as expected
  2  bad input   3  tick, time or memory limit   4  synthesizer failure
  130  interrupted
"""


@click.command(epilog=RUN_EPILOG)
@click.argument("scenario", type=options.INPUT)
@options.trace
@options.html
@options.motion
@options.as_json
@options.seed
@options.max_ticks
@options.time_limit
@click.option(
    "--clock", type=click.Choice(["live", "lockstep"]), help="In seconds (live) or ticks."
)
@options.operator
@options.live
@options.maps
def run(
    scenario: Path,
    trace: Path | None,
    html: Path | None,
    motion: Path | None,
    as_json: bool,
    seed: int | None,
    max_ticks: int | None,
    time_limit: float | None,
    clock: str | None,
    operator: str | None,
    live: bool,
    maps: bool,
) -> int:
    """Run SCENARIO: synthesize a controller for each robot, then execute them in a world
    with the scenario's hidden obstacles until every robot has met its objective."""
    if live:
        from safenav.studio.server import start_live

        unread = ("html", "motion", "as_json", "max_ticks", "time_limit", "operator", "maps")
        options.refuse(dict.fromkeys(unread, "a run at the terminal, without --live"))
        start_live(scenario, seed=seed, trace=trace, clock=clock)
        return ExitCode.OK
    plan = load_scenario(scenario)
    for note in plan.map.notes:
        warn(note)
    plan = plan if clock is None else replace(plan, clock=Clock(clock))
    plan = limited(plan, max_ticks, time_limit, seed)
    return _simulated(plan, Files(scenario, trace, html, motion, as_json, maps), operator)


def _simulated(
    plan: Scenario, files: Files, operator: str | None, begun: Resumption | None = None
) -> int:
    """Run a scenario in its own world; return the exit code. ``begun``: the run that it
    continues."""
    _check_movable(plan, files.motion)
    operator = attendant(operator, plan, files.as_json)

    def make(plan: Scenario, listeners: list[Listener]) -> Mission:
        return Mission(
            plan,
            default_synthesizer(plan),
            listeners=listeners,
            progress=WaitingLine(),
            attended=operator is not None,
            begun=begun,
            checkpoints=True,
        )

    return carried_out(plan, make, files, operator, motion=_write_motion, advice=begun is None)


def _check_movable(plan: Scenario, motion: Path | None) -> None:
    """Refuse what has no motion before a robot moves, not when the file is written."""
    if motion is not None:
        from safenav.motion.making import check_movable

        check_movable(plan)


def _write_motion(trace: Path, motion: Path) -> list[str]:
    """Write the motion of a run; return a message for each requirement that is not satisfied."""
    from safenav.motion.check.requirements import MotionRecording, judged, requirements_of
    from safenav.motion.file import text_of
    from safenav.motion.making import motion_of
    from safenav.trace.file import read_trace

    read = read_trace(trace)
    made = motion_of(read)
    write_out(motion, text_of(made))
    found = judged(MotionRecording(made, read), requirements_of(read))
    return [one.complaint for one in found if one.complaint]


RESUME_EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl
  head -120 lab.jsonl > part.jsonl               # as if that run had been killed
  safenav resume part.jsonl --trace whole.jsonl
\b
Exit codes: those of 'safenav run', for the resumed run
"""


@click.command(epilog=RESUME_EPILOG)
@click.argument("trace", type=options.INPUT)
@click.option("--trace", "own", type=options.LINES, help="Write the trace of the resumed run.")
@options.html
@options.motion
@options.as_json
@options.seed
@options.max_ticks
@options.time_limit
@options.operator
@options.maps
def resume(
    trace: Path,
    own: Path | None,
    html: Path | None,
    motion: Path | None,
    as_json: bool,
    seed: int | None,
    max_ticks: int | None,
    time_limit: float | None,
    operator: str | None,
    maps: bool,
) -> int:
    """Continue the run of TRACE from its last checkpoint. Strategies are synthesized again where
    the robots are. The trace of the resumed run begins with the lines
    before that checkpoint, so it is the trace of one run. It has the clock of TRACE."""
    from safenav.trace.file import read_trace

    before = read_trace(trace)
    if before.header.world == "external":
        raise UsageError(f"{trace}: real robots have run it; safenav drive --resume continues it")
    plan = limited(before.scenario, max_ticks, time_limit, seed)
    files = Files(trace, own, html, motion, as_json, maps)
    return _simulated(plan, files, operator, _continued(before, plan))


def _continued(trace: Trace, plan: Scenario) -> Resumption:
    """The run of a trace at its last checkpoint. Raises InputError if its lines contradict each
    other, UsageError if the checkpoint has robots elsewhere."""
    from safenav.run.reading import run_of
    from safenav.runtime.run.checkpoint import resumption

    begun = resumption(trace, plan)
    told, tick = run_of(replace(trace, records=begun.lines[1:])), begun.kept.memory.tick
    if plan.clock is Clock.LOCKSTEP and told.last != tick:
        raise UsageError(f"{trace.source}: a checkpoint of tick {tick} follows tick {told.last}")
    for track, robot in zip(told.robots, begun.standing(plan).robots, strict=True):
        if track.regions[-1] != robot.start.region:
            where = f"in {robot.start.region}, the lines before it in {track.regions[-1]}"
            raise UsageError(f"{trace.source}: a checkpoint has {robot.name} {where}")
    return begun


DRIVE_EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav new fleet.yaml --fleet lab.yaml
  safenav drive lab.yaml --fleet fleet.yaml --rehearse --trace lab.jsonl
  safenav drive lab.yaml --fleet fleet.yaml --live
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


@click.command(epilog=DRIVE_EPILOG)
@click.argument("scenario", type=options.INPUT)
@click.option(
    "--fleet",
    type=options.INPUT,
    required=True,
    help="Connection, sensors and actions of each robot (docs/drive.md).",
)
@options.trace
@click.option("--motion", type=options.LINES, help="Write the motion commanded and measured.")
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
@options.as_json
@options.maps
@options.time_limit
@click.option(
    "--patience",
    type=options.SECONDS,
    default=10.0,
    metavar="S",
    help="Seconds that each robot has to answer at the start.  [10]",
)
def drive(
    scenario: Path,
    fleet: Path,
    trace: Path | None,
    motion: Path | None,
    rehearse: bool,
    begun: Path | None,
    operator: str | None,
    live: bool,
    as_json: bool,
    maps: bool,
    time_limit: float | None,
    patience: float,
) -> int:
    """Run SCENARIO with the robots of a fleet file. safenav decides where each robot goes next; the
    robots' own navigation drives them there."""
    from safenav.fleet.file import load_fleet, side_of
    from safenav.fleet.robots import unserved
    from safenav.fleet.transport import DriveRecording
    from safenav.fleet.world import fleet_world
    from safenav.scenario.lint import imprecise, oversized
    from safenav.trace.file import read_trace

    plan = load_scenario(scenario)
    plan = limited(replace(plan, clock=Clock.LIVE), None, time_limit)
    before = None if begun is None else read_trace(begun)
    first = None if before is None else _continued(before, plan)
    if before is not None and not rehearse and before.header.world == "simulated":
        raise UsageError(f"{begun}: no real robot has run it; add --rehearse")
    if motion is not None and rehearse:
        hint = "use safenav export TRACE --motion FILE"
        raise UsageError(f"--motion: no robot moves in a rehearsal\n    {hint}")
    if motion is not None and begun is not None:
        raise UsageError(f"--motion: {begun} has no motion before its checkpoint: leave it out")
    stations = load_fleet(fleet, plan)
    side = side_of(plan.map)
    tolerances = {name: station.off(side) for name, station in stations.stations.items()}
    sizes = (*oversized(plan), *imprecise(plan, tolerances))
    for warning in (*plan.map.notes, *sizes, *unserved(plan, stations)):
        warn(warning)
    _check_movable(plan, motion)
    recording = None if motion is None else DriveRecording()
    operator = attendant(operator, plan, as_json)
    driven: list[tuple[Mission, FleetWorld | None]] = []

    def mission(plan: Scenario, listeners: list[Listener]) -> Mission:
        """Return the mission, for real robots once each of them has answered."""
        plan = replace(plan, failures=stations.failures)
        world = None
        if not rehearse:
            begins = plan if first is None else first.standing(plan)
            world = fleet_world(begins, stations, recording)
            connection.callback(world.close)
            world.open(patience)
            listeners = [*listeners, world.observe]
        made = Mission(
            plan,
            default_synthesizer(plan),
            world=world,
            listeners=listeners,
            attended=operator is not None,
            begun=first,
            checkpoints=True,
        )
        driven.append((made, world))
        return made

    def write_motion(trace: Path, file: Path) -> Sequence[str]:
        from safenav.fleet.driven import driven_motion
        from safenav.motion.file import text_of

        made, world = driven[0]
        if world is not None:
            run = read_trace(trace)
            moved = driven_motion(run, world, stations.stations, made.began)
            write_out(file, text_of(moved))
        return ()

    with ExitStack() as stack:
        view = None
        if live:
            from safenav.studio.server import LiveView

            view = stack.enter_context(LiveView(plan))
            click.echo(f"live: {view.address}", err=True)
        connection = stack.enter_context(ExitStack())
        status = carried_out(
            plan,
            mission,
            Files(scenario, trace, None, motion, as_json, maps),
            operator,
            motion=write_motion,
            views=() if view is None else (view,),
            ended=connection.close,
        )
        if view is not None:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            view.wait()
    return status
