"""``safenav run``: run a scenario and print what happens."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from msgspec.structs import replace

from safenav.cli import options
from safenav.cli.output import FILE, TRACE_PAGE_OR_FOLDER
from safenav.cli.status import exit_code_of
from safenav.errors import ExitCode, UsageError
from safenav.outcome import Outcome

if TYPE_CHECKING:
    from safenav.runtime.analysis.expectation import Ledger
    from safenav.runtime.mission import Mission
    from safenav.scenario.model import Scenario
    from safenav.trace.records import Record
    from safenav.trace.writing import Listener

PATIENCE = 0.8
"""Seconds between the first signal and the end of a run that does not notice it."""

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml
  safenav run lab.yaml -o out                    # out/lab.jsonl and out/lab.html
  safenav run lab.yaml --html lab.html --trace lab.jsonl
  safenav run lab.yaml --json --seed 7
  safenav run lab.yaml --motion lab.motion.jsonl # extra 'motion'
  safenav run lab.yaml --live                    # extra 'studio'
  safenav run lab.yaml --clock live              # robots move at the same time
  echo give_up > fixes.txt && safenav run lab.yaml --clock live --operator fixes.txt
\b
Exit codes:
  0  the run ended as the scenario expects (without 'expect': completed)
  1  operator needed, unrealizable, or not as expected
  2  bad input   3  tick, time or memory limit   4  synthesizer failure
  130  interrupted
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    type=TRACE_PAGE_OR_FOLDER,
    help="Output: FILE.jsonl (trace), FILE.html (replay) or a folder for both.",
)
@click.option("--trace", type=FILE, help="Write the trace (JSON Lines).")
@click.option("--html", type=FILE, help="Write the replay as one HTML page.")
@click.option("--motion", type=FILE, help="Write the run in metres and seconds.")
@options.result_as_json
@options.seed
@click.option("--max-ticks", type=click.IntRange(min=1), help="Stop after this many ticks.")
@click.option(
    "--time-limit",
    type=options.SECONDS,
    help="Stop after this many seconds (of the simulated clock, in a live run).",
)
@click.option(
    "--clock",
    type=click.Choice(["live", "lockstep"]),
    help="Override the scenario's clock: seconds (live) or ticks (lockstep).",
)
@click.option("--lockstep", "clock", flag_value="lockstep", help="Short for --clock lockstep.")
@options.operator
@options.verify
@options.live
@click.option(
    "--map/--no-map",
    "maps",
    default=True,
    help="Draw the map at the start, requests, resolutions, end.",
)
def command(
    scenario: Path,
    output: Path | None,
    trace: Path | None,
    html: Path | None,
    motion: Path | None,
    as_json: bool,
    seed: int | None,
    max_ticks: int | None,
    time_limit: float | None,
    clock: str | None,
    operator: str | None,
    verify: bool,
    live: bool,
    maps: bool,
) -> int:
    """Run SCENARIO: synthesize a controller for each robot, then execute them in a world
    with the scenario's hidden obstacles until every robot has met its objective."""
    if live:
        return _watch(scenario, seed, trace, clock)
    from safenav.cli.operator import run_with_operator
    from safenav.report.terminal.story import Story
    from safenav.report.terminal.synthesis_progress import WaitingLine
    from safenav.runtime.analysis.expectation import Ledger
    from safenav.runtime.mission import Mission, default_synthesizer
    from safenav.scenario.reading.loader import load_scenario
    from safenav.scenario.settings import Clock
    from safenav.trace.writing import TraceWriter, next_part

    plan = load_scenario(scenario)
    for note in plan.map.notes:
        click.echo(f"warning: {note}", err=True)
    if seed is not None:
        plan = replace(plan, seed=seed)
    if max_ticks is not None:
        plan = replace(plan, limits=replace(plan.limits, ticks=max_ticks))
    if time_limit is not None:
        plan = replace(plan, limits=replace(plan.limits, seconds=time_limit))
    if clock is not None:
        plan = replace(plan, clock=Clock(clock))
    if output is not None:
        trace, html = _by_its_ending(output, scenario.stem, trace, html)
    _refuse_same_files(scenario, {"--trace": trace, "--html": html, "--motion": motion})
    if motion is not None:
        from safenav.motion.making import check_movable

        check_movable(plan)
    synthesizer = default_synthesizer(plan, verify=verify)
    kept = trace
    ledger = Ledger()
    listeners: list[Listener] = [ledger]
    with ExitStack() as stack:
        if (html is not None or motion is not None) and trace is None:
            from tempfile import TemporaryDirectory

            trace = Path(stack.enter_context(TemporaryDirectory())) / f"{scenario.stem}.jsonl"
        if trace is not None:
            listeners.append(stack.enter_context(TraceWriter(trace)))
        if not as_json:
            listeners.append(while_heard(Story(plan, maps=maps)))
        operator = attendant(operator, plan.clock is Clock.LIVE, as_json)
        mission = Mission(
            plan,
            synthesizer,
            listeners=listeners,
            progress=WaitingLine(),
            attended=operator is not None,
        )

        def another(rest: Scenario) -> Mission:
            """The mission that continues with a robot more, and has a trace of its own."""
            nonlocal mission, trace, kept
            told: list[Listener] = [ledger]
            if trace is not None:
                trace = next_part(trace)
                kept = kept and trace
                told.append(stack.enter_context(TraceWriter(trace)))
            if not as_json:
                told.append(while_heard(Story(rest, maps=maps)))
            made = default_synthesizer(rest, verify=verify)
            mission = Mission(rest, made, listeners=told, progress=WaitingLine(), attended=True)
            return mission

        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM):
            signal.signal(number, lambda number, _: interrupt(mission, number))
        wall = plan.limits.seconds if plan.clock is Clock.LOCKSTEP else None
        signal.setitimer(signal.ITIMER_REAL, wall or 0, PATIENCE)
        if operator is None:
            mission.run()
        else:
            run_with_operator(mission, operator, helping=not as_json, another=another)
        signal.setitimer(signal.ITIMER_REAL, 0)
        if html is not None and trace is not None:
            _write_page(trace, html)
        unmet = []
        if motion is not None and trace is not None:
            unmet = _write_motion(trace, motion)
    return report(mission, scenario, ledger, as_json, kept, html, unmet)


def report(
    mission: Mission,
    scenario: Path,
    ledger: Ledger,
    as_json: bool,
    trace: Path | None = None,
    html: Path | None = None,
    unmet: Sequence[str] = (),
) -> int:
    """Print how a run ended, and what differs from what the scenario expects (``unmet``:
    differences found before); the exit code."""
    from safenav.runtime.analysis.expectation import differences

    assert mission.result is not None
    plan, outcome = mission.scenario, mission.result.outcome
    wrong = [*differences(plan.expect, ledger, plan.map.word), *unmet]
    if as_json:
        click.echo(json.dumps(_record(ledger, mission, wrong), indent=2))
    for difference in wrong:
        click.echo(f"{click.style('not as expected:', fg='red')} {difference}", err=True)
    status = _status(outcome, plan.expect.outcome is not None, bool(wrong))
    if status in (ExitCode.NEGATIVE, ExitCode.RESOURCE_LIMIT) and not as_json:
        for line in _next_steps(outcome, scenario, trace, html):
            click.echo(f"    {line}", err=True)
    return status


def attendant(given: str | None, live: bool, as_json: bool) -> str | None:
    """The file of interventions; TERMINAL where somebody can be asked. Raises UsageError."""
    from safenav.cli.operator import TERMINAL

    if given is not None and not live:
        raise UsageError("--operator helps live runs only; add '--clock live'")
    if given is None and live and not as_json and sys.stdin.isatty() and sys.stderr.isatty():
        return TERMINAL
    return given


def _watch(scenario: Path, seed: int | None, trace: Path | None, clock: str | None) -> int:
    """The run in a browser, until Ctrl-C."""
    from safenav.studio.starting import start_live

    _refuse_same_files(scenario, {"--trace": trace})
    start_live(scenario, seed=seed, trace=trace, clock=clock)
    return ExitCode.OK


def interrupt(mission: Mission, number: int) -> None:
    """Stop at the next safe point; immediately on a second signal or after PATIENCE. The clock's
    own first signal ends the run at its time limit."""
    if number == signal.SIGALRM and mission.ending:
        return
    if mission.stopping:
        raise KeyboardInterrupt
    if number == signal.SIGALRM:
        mission.look_at_the_clock()
        return
    mission.stop()
    signal.setitimer(signal.ITIMER_REAL, PATIENCE)


def _by_its_ending(
    output: Path, stem: str, trace: Path | None, html: Path | None
) -> tuple[Path | None, Path | None]:
    """Trace and page of ``--output``. Raises UsageError if another option names one of them."""
    writes_trace, writes_page = output.suffix != ".html", output.suffix != ".jsonl"
    for option, given in (("--trace", writes_trace and trace), ("--html", writes_page and html)):
        if given:
            raise UsageError(
                f"--output {output} and {option} {given} name the same output; give one"
            )
    if not writes_page:
        return output, html
    if not writes_trace:
        return trace, output
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"cannot write to {output}: {error.strerror}") from error
    name = stem if stem != "-" else "scenario"
    return output / f"{name}.jsonl", output / f"{name}.html"


def _refuse_same_files(scenario: Path, outputs: dict[str, Path | None]) -> None:
    """Raises UsageError if a file that is to be written is the scenario, or another output."""
    taken = {scenario.resolve(): "the scenario"}
    for option, path in outputs.items():
        if path is None:
            continue
        first = taken.setdefault(path.resolve(), option)
        if first != option:
            raise UsageError(f"{option} {path} would overwrite {first}; give another file")


def while_heard(listener: Listener) -> Listener:
    """A listener that falls silent when the reader of our output has gone: the run continues."""
    heard = True

    def hear(record: Record) -> None:
        nonlocal heard
        if not heard:
            return
        try:
            listener(record)
        except BrokenPipeError:
            heard = False
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())

    return hear


def _next_steps(outcome: str, scenario: Path, trace: Path | None, html: Path | None) -> list[str]:
    """Commands that show what went wrong."""
    from shlex import quote

    name = quote(str(scenario))
    steps = []
    if html is not None:
        steps.append(f"view: open {quote(str(html))} (starts at the last tick)")
    elif trace is not None:
        steps.append(f"view: safenav replay {quote(str(trace))}")
    else:
        steps.append(f"view: safenav run {name} --html {quote(scenario.stem)}.html")
    if outcome in ("unrealizable", "operator_needed"):
        steps.append(f"explain: safenav explain {name}")
    elif outcome == "tick_limit":
        steps.append(f"run longer: safenav run {name} --max-ticks N")
    return steps


def _write_page(trace: Path, html: Path) -> None:
    from safenav.outfile import write_bytes
    from safenav.report.page.html import page_of_trace
    from safenav.trace.reading import read_trace

    write_bytes(html, page_of_trace(read_trace(trace), trace.name).encode())


def _write_motion(trace: Path, motion: Path) -> list[str]:
    """Write the motion of a run; returns which requirements of the scenario it does not satisfy."""
    from safenav.motion.file.writing import text_of
    from safenav.motion.making import motion_of
    from safenav.motion.requirements import MotionRecording, judged, requirements_of
    from safenav.outfile import write_bytes
    from safenav.trace.reading import read_trace

    read = read_trace(trace)
    made = motion_of(read)
    write_bytes(motion, text_of(made).encode())
    found = judged(MotionRecording(made, read), requirements_of(read))
    return [one.complaint for one in found if one.complaint]


def _status(outcome: Outcome, expected: bool, wrong: bool) -> ExitCode:
    if outcome is Outcome.INTERRUPTED:
        return ExitCode.INTERRUPTED
    if wrong:
        return exit_code_of(outcome) or ExitCode.NEGATIVE
    return ExitCode.OK if expected else exit_code_of(outcome)


def _record(ledger: Any, mission: Any, wrong: list[str]) -> dict[str, Any]:
    result = mission.result
    return {
        "scenario": mission.scenario.name,
        "outcome": result.outcome.value,
        "explanation": result.explanation,
        "cause": result.cause,
        "as_expected": not wrong,
        "differences": wrong,
        "resolved": ledger.resolved,
        "blocked": ledger.blocked,
        "helpers": ledger.helpers,
        "rounds": result.rounds,
        "ticks": result.ticks,
        "seconds": result.seconds,
        "makespan": result.makespan,
        "syntheses": result.syntheses,
        "synthesis_seconds": result.synthesis_seconds,
    }
