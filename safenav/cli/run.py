"""``safenav run``, ``resume`` and ``drive``: run a scenario or the rest of a run."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from functools import partial
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import click
from msgspec import Struct
from msgspec.structs import replace

from safenav.batch.case import Ledger, differences
from safenav.cli import options, warn_of
from safenav.cli.operator import attended, run_with_operator
from safenav.errors import ExitCode, Outcome, UsageError, exit_code_of
from safenav.files import json_line, write_out
from safenav.report.terminal.layout import WaitingLine, echo_lines
from safenav.runtime.run.mission import Mission, default_synthesizer
from safenav.scenario.model import Clock, Expect, Scenario
from safenav.scenario.reading.loader import load_scenario
from safenav.strict_json import MOST_NUMBER
from safenav.trace.file import Listener, TraceWriter, as_data, read_bytes, read_trace

if TYPE_CHECKING:
    from safenav.fleet.world import FleetWorld
    from safenav.runtime.run.checkpoint import Resumption
    from safenav.trace.file import Trace

PATIENCE = 0.8
"""Seconds from the first signal to the end of an unresponsive run."""

RUN_EXAMPLES = """\
  safenav new lab.yaml && safenav run lab.yaml
  safenav run lab.yaml --html lab.html --trace lab.jsonl
  safenav run lab.yaml --live
  safenav run lab.yaml --clock live              # robots move at the same time
  echo give_up | safenav run lab.yaml --clock live --operator
"""
AS_EXPECTED = "as the scenario expects (without 'expect': completed in time, no order open)"
NOT_AS_EXPECTED = "operator needed, unrealizable, or not as expected"


SEED = click.IntRange(0, MOST_NUMBER)
CLOCK = click.Choice(["live", "lockstep"])


@options.command(RUN_EXAMPLES, AS_EXPECTED, NOT_AS_EXPECTED)
def run(
    scenario: options.InputFile,
    trace: options.Trace,
    html: options.Html,
    as_json: options.AsJson,
    seed: Annotated[int | None, SEED, "--seed N", "Override the scenario's seed."],
    max_ticks: options.MaxTicks,
    time_limit: options.TimeLimit,
    clock: Annotated[str | None, CLOCK, "Measure time in seconds (live) or ticks."],
    operator: options.Operator,
    live: options.Live,
    no_map: options.NoMap,
) -> int:
    """Run SCENARIO: synthesize a controller for each robot, then execute them in a world
    with the scenario's hidden obstacles until every robot has met its objective."""
    if live:
        from safenav.studio.server import serve
        from safenav.studio.session import Studio

        if trace == PRINTED:
            raise UsageError("--trace - requires a run without --live")
        unread = ("html", "as_json", "max_ticks", "time_limit", "operator", "no_map")
        options.refuse("a run without --live", *unread)
        serve(Studio.of_run(scenario, seed, trace, clock))
        return ExitCode.OK
    plan = load_scenario(scenario)
    warn_of(plan.map.notes)
    plan = plan if clock is None else replace(plan, clock=Clock(clock))
    plan = plan if seed is None else replace(plan, seed=seed)
    plan = _limited(plan, max_ticks, time_limit)
    return _executed(plan, Files(scenario, trace, html, as_json, no_map), operator)


RESUME_EXAMPLES = """\
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl
  head -120 lab.jsonl > part.jsonl               # as if that run had been killed
  safenav resume part.jsonl --trace whole.jsonl
"""


@options.command(RESUME_EXAMPLES, AS_EXPECTED, NOT_AS_EXPECTED)
def resume(
    trace: options.InputFile,
    own: Annotated[options.Lines, "--trace", "Write the trace of the resumed run."],
    as_json: options.AsJson,
    max_ticks: options.MaxTicks,
    time_limit: options.TimeLimit,
    operator: options.Operator,
    no_map: options.NoMap,
) -> int:
    """Continue the run of TRACE from its last checkpoint. Strategies are synthesized again where
    the robots are. The trace of the resumed run begins with the lines
    before that checkpoint, so it is the trace of one run. It has the clock of TRACE."""
    before = read_trace(trace)
    if before.header.world == "external":
        raise UsageError(f"{trace}: real robots have run it; safenav drive --resume continues it")
    plan = _limited(before.scenario, max_ticks, time_limit)
    files = Files(trace, own, as_json=as_json, no_map=no_map)
    return _executed(plan, files, operator, _continued(before, plan))


def _limited(plan: Scenario, ticks: int | None, seconds: float | None) -> Scenario:
    """Return the scenario with the limits of the command line."""
    given = {"ticks": ticks, "seconds": seconds}
    limits = {name: value for name, value in given.items() if value is not None}
    return replace(plan, limits=replace(plan.limits, **limits))


def _continued(trace: Trace, plan: Scenario) -> Resumption:
    """Return the run of a trace at its last checkpoint. Raises InputError if lines of the trace
    contradict each other, UsageError if the checkpoint and the lines place robots differently."""
    from safenav.run.reading import run_of
    from safenav.runtime.run.checkpoint import resumption

    begun = resumption(trace, plan)
    told, tick = run_of(replace(trace, records=begun.lines[1:])), begun.kept.memory.tick
    if plan.clock is Clock.LOCKSTEP and told.last != tick:
        raise UsageError(f"{trace.source}: a checkpoint of tick {tick} follows tick {told.last}")
    reached, end = tick, trace.outcome  # a checkpoint precedes the last tick
    if end is not None and end.outcome is Outcome.TICK_LIMIT:
        reached = end.tick
    if plan.clock is Clock.LOCKSTEP and reached >= (most := plan.limits.ticks):
        raise UsageError(f"{trace.source}: at its limit, tick {most}; give a higher --max-ticks")
    for track, robot in zip(told.robots, begun.standing(plan).robots, strict=True):
        if track.regions[-1] != robot.start.region:
            where = f"in region {robot.start.region}, but it was last in {track.regions[-1]}"
            raise UsageError(f"{trace.source}: a checkpoint has {robot.name} {where}")
    return begun


DRIVE_EXAMPLES = """\
  safenav new lab.yaml && printf 'safenav-fleet: 1\\ntransport: ros2\\n' > fleet.yaml
  safenav drive lab.yaml --fleet fleet.yaml --rehearse --trace lab.jsonl
  safenav drive lab.yaml --fleet fleet.yaml --live
  head -120 lab.jsonl > part.jsonl                   # as if that drive had been killed
  safenav drive lab.yaml --fleet fleet.yaml --rehearse --resume part.jsonl --trace b.jsonl
Without --rehearse the robots of the fleet file move.
\b
Ctrl-C stops all robots, then ends the run; a second one ends it immediately.
"""


@options.command(DRIVE_EXAMPLES, AS_EXPECTED, NOT_AS_EXPECTED)
def drive(
    scenario: options.InputFile,
    *,
    fleet: Annotated[options.InputFile, "The fleet file (docs/drive.md)."],
    trace: options.Trace,
    rehearse: Annotated[bool, "Simulate the run; no robot moves."],
    begun: Annotated[options.InputOption, "--resume TRACE", "Continue the drive of this trace."],
    operator: options.Operator,
    live: options.Live,
    as_json: options.AsJson,
    no_map: options.NoMap,
    time_limit: options.TimeLimit,
    patience: Annotated[float, options.SECONDS, "Maximum wait for the robots' answers."] = 10.0,
) -> int:
    """Run SCENARIO with the robots of a fleet file. safenav decides where each robot goes next; the
    robots' own navigation drives them there."""
    from safenav.fleet.file import load_fleet
    from safenav.fleet.robots import unserved
    from safenav.fleet.world import fleet_world
    from safenav.review.lint import imprecise, oversized

    plan = _limited(replace(load_scenario(scenario), clock=Clock.LIVE), None, time_limit)
    before = None if begun is None else read_trace(begun)
    if before is not None and not rehearse and before.header.world == "simulated":
        raise UsageError(f"{begun}: no real robot has run it; add --rehearse")
    stations = load_fleet(fleet, plan)
    plan = replace(plan, obstacles=tuple(stations.obstacles)) if rehearse else plan
    first = None if before is None else _continued(before, plan)
    tolerances = {name: station.tolerance for name, station in stations.stations.items()}
    sizes = (*oversized(plan), *imprecise(plan, tolerances))
    warn_of([*plan.map.notes, *sizes, *unserved(plan, stations)])

    @contextmanager
    def connected() -> Iterator[FleetWorld]:
        with closing(fleet_world(plan, stations, first)) as world:
            world.open(patience)
            yield world

    plan = replace(plan, failures=stations.failures)
    files = Files(scenario, trace, as_json=as_json, no_map=no_map)
    drives = None if rehearse else connected
    if not live:
        return _executed(plan, files, operator, first, drives)
    from safenav.studio.server import LiveView

    with LiveView(plan) as view:
        click.echo(f"live: {view.address}", err=True)
        status = _executed(plan, files, operator, first, drives, [view])
        if status != ExitCode.INTERRUPTED:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            view.wait()
    return status


PRINTED = Path("-")
"""The name of standard output."""


class Files(Struct, frozen=True):
    """The files that a run writes and its printed output. ``scenario``: the scenario's file."""

    scenario: Path
    trace: Path | None = None
    html: Path | None = None
    as_json: bool = False
    no_map: bool = False

    @property
    def printed(self) -> bool:
        """Whether the run prints a file on standard output in place of its story."""
        return PRINTED in (self.trace, self.html)


def _executed(
    plan: Scenario,
    files: Files,
    operator: bool,
    begun: Resumption | None = None,
    connected: Callable[[], AbstractContextManager[FleetWorld]] | None = None,
    views: Sequence[Listener] = (),
) -> int:
    """Run a scenario, write its files and print its events. Return the exit code. ``begun``: the
    run to continue; ``connected``: the world of real robots."""
    operator = attended(operator, plan, files.as_json)
    ledger, kept = Ledger(), list[str]()
    with ExitStack() as running:
        listeners: list[Listener] = [ledger, *views]
        if files.html is not None:
            listeners.append(lambda line: kept.append(json_line(as_data(line))))
        if files.trace == PRINTED:
            listeners.append(lambda line: click.echo(json_line(as_data(line)), nl=False))
        elif files.trace is not None:
            listeners.append(running.enter_context(TraceWriter(files.trace)))
        if not files.as_json:
            from safenav.report.terminal.story import Story

            echo = partial(click.echo, err=files.printed)
            listeners.append(Story(plan, echo, not files.no_map))
        mission = Mission(
            plan,
            default_synthesizer(plan),
            world=None if connected is None else running.enter_context(connected()),
            listeners=listeners,
            progress=WaitingLine(),
            attended=operator,
            begun=begun,
            checkpoints=files.trace is not None,
        )
        _carry_out(mission, operator)
    if files.html is not None:
        from safenav.report.page.html import page_of

        name = f"{files.scenario.stem}.jsonl" if files.trace is None else files.trace.name
        write_out(files.html, page_of(read_bytes("".join(kept).encode(), name), name))
    return _reported(mission, ledger, files, advice=begun is None)


def _carry_out(mission: Mission, operator: bool) -> None:
    """Run a mission to its end. ``operator``: whether to prompt for interventions in waits."""
    plan = mission.scenario
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM):
        signal.signal(number, lambda number, _: _interrupt(mission, number))
    wall = plan.limits.seconds if plan.clock is Clock.LOCKSTEP else None
    signal.setitimer(signal.ITIMER_REAL, wall or 0, PATIENCE)
    try:
        if operator:
            run_with_operator(mission)
        else:
            mission.run()
    except KeyboardInterrupt:  # between two passes
        if mission.ending:
            raise
        mission.give_up()
    signal.setitimer(signal.ITIMER_REAL, 0)


def _interrupt(mission: Mission, number: int) -> None:
    """Stop the run at the next safe point; immediately on a second signal or after PATIENCE. The
    first SIGALRM ends the run at its time limit."""
    if number == signal.SIGALRM and mission.ending:
        return
    if mission.stopping:
        raise KeyboardInterrupt
    if number == signal.SIGALRM:
        mission.check_time_limit()
        return
    mission.stop()
    signal.setitimer(signal.ITIMER_REAL, PATIENCE)


def _reported(mission: Mission, ledger: Ledger, files: Files, *, advice: bool) -> int:
    """Print the differences between the run and its expectations, and the next steps (``advice``).
    Return the exit code."""
    assert mission.result is not None
    plan, result = mission.scenario, mission.result
    outcome, expected = result.outcome, plan.expect
    interrupted = outcome is Outcome.INTERRUPTED
    compares = not interrupted or expected.outcome is outcome
    wrong = differences(expected, ledger, plan.map.word) if compares else []
    if files.as_json:
        data = ledger.measured(plan.name)
        data |= {"as_expected": not wrong if compares else None, "differences": wrong}
        options.print_json(data)
    for difference in wrong:
        click.echo(f"{click.style('not as expected:', fg='red')} {difference}", err=True)
    status = exit_code_of(outcome)
    if not interrupted and wrong:
        status = status or ExitCode.NEGATIVE
    elif not interrupted and expected.outcome is not None:
        status = ExitCode.OK
    if not files.as_json:
        if expected != Expect() and not compares:
            click.echo("note: 'expect' is not checked, since the run was interrupted", err=True)
        if advice and status in (ExitCode.NEGATIVE, ExitCode.RESOURCE_LIMIT):
            echo_lines(_next_steps(outcome, files), err=True)
    return status


def _next_steps(outcome: Outcome, files: Files) -> Iterator[str]:
    """Yield commands that show the cause of the outcome or run the scenario longer."""
    name = quote(str(files.scenario))
    if files.html not in (None, PRINTED):
        yield f"    view: open {quote(str(files.html))} (starts at the last tick)"
    elif files.trace not in (None, PRINTED):
        yield f"    view: safenav replay {quote(str(files.trace))}"
    elif name != "-":
        yield f"    view: safenav run {name} --html {quote(files.scenario.stem)}.html"
    if outcome in (Outcome.UNREALIZABLE, Outcome.OPERATOR_NEEDED) and name != "-":
        yield f"    explain: safenav explain {name}"
    elif outcome is Outcome.TICK_LIMIT and name != "-":
        yield f"    run longer: safenav run {name} --max-ticks N"
