"""A run at the terminal: its files, its interruption, its operator, and the report of its end."""

from __future__ import annotations

import json
import os
import re
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from select import select
from shlex import quote
from typing import TYPE_CHECKING

import click
from msgspec import Struct
from msgspec.structs import replace

from safenav.batch.case import Ledger, differences, measured
from safenav.cli import warn
from safenav.errors import ExitCode, Outcome, UsageError, exit_code_of
from safenav.files import read_file, write_out
from safenav.runtime.run.mission import Mission
from safenav.scenario.model import Clock, Expect, Scenario
from safenav.trace.file import Listener, TraceWriter

if TYPE_CHECKING:
    from safenav.runtime.interventions import Intervention

PATIENCE = 0.8
"""Seconds after the first signal until a run that does not react is ended."""
TERMINAL = "-"
PASSES = 200
"""Maximum number of passes for commands to end before the operator is prompted."""
POLL = 0.05
"""Seconds between two checks for terminal input."""

MakeMission = Callable[[Scenario, list[Listener]], Mission]
"""Makes the mission of a scenario with these listeners."""
WriteMotion = Callable[[Path, Path], Sequence[str]]
"""Writes the motion of a run, given its trace; returns the requirements that it violates."""


class Files(Struct, frozen=True):
    """The files that a run writes, and what it prints. ``scenario``: its file."""

    scenario: Path
    trace: Path | None = None
    html: Path | None = None
    motion: Path | None = None
    as_json: bool = False
    maps: bool = True


def limited(
    plan: Scenario, ticks: int | None, seconds: float | None, seed: int | None = None
) -> Scenario:
    """Return the scenario with the limits and the seed of the command line."""
    given = {"ticks": ticks, "seconds": seconds}
    limits = {name: value for name, value in given.items() if value is not None}
    plan = replace(plan, limits=replace(plan.limits, **limits))
    return plan if seed is None else replace(plan, seed=seed)


def attendant(given: str | None, plan: Scenario, as_json: bool) -> str | None:
    """Return the source of interventions: the given file, or TERMINAL if a user can answer there;
    None: no operator. Raises UsageError for a file without a live run."""
    live = plan.clock is Clock.LIVE
    if given is not None and not live:
        raise UsageError("--operator helps live runs only; add '--clock live'")
    if given is None and live and not as_json and sys.stdin.isatty() and sys.stderr.isatty():
        return TERMINAL
    return given


def carried_out(
    plan: Scenario,
    make: MakeMission,
    files: Files,
    operator: str | None,
    *,
    motion: WriteMotion,
    views: Sequence[Listener] = (),
    ended: Callable[[], None] = lambda: None,
    advice: bool = True,
) -> int:
    """Run the mission of a scenario, write its files and report its end; return the exit code.

    ``operator``: the source of interventions; ``views``: further listeners; ``ended`` is called
    before the files are written; ``advice``: name the next steps of a run that ends badly.
    """
    ledger = Ledger()
    with ExitStack() as stack:
        trace = files.trace
        if trace is None and (files.html is not None or files.motion is not None):
            folder = stack.enter_context(tempfile.TemporaryDirectory())
            trace = Path(folder, f"{files.scenario.stem}.jsonl")
        listeners: list[Listener] = [ledger]
        if trace is not None:
            listeners.append(stack.enter_context(TraceWriter(trace)))
        if not files.as_json:
            from safenav.report.terminal.layout import terminal_width
            from safenav.report.terminal.story import Story

            listeners.append(Story(plan, maps=files.maps, width=terminal_width()))
        mission = make(plan, [*listeners, *views])
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM):
            signal.signal(number, lambda number, _: _interrupt(mission, number))
        wall = mission.scenario.limits.seconds if plan.clock is Clock.LOCKSTEP else None
        signal.setitimer(signal.ITIMER_REAL, wall or 0, PATIENCE)
        if operator is None:
            mission.run()
        else:
            run_with_operator(mission, operator)
        signal.setitimer(signal.ITIMER_REAL, 0)
        ended()
        if files.html is not None and trace is not None:
            from safenav.report.page.html import page_of_trace
            from safenav.trace.file import read_trace

            write_out(files.html, page_of_trace(read_trace(trace), trace.name))
        unmet = motion(trace, files.motion) if files.motion is not None and trace else ()
    return _reported(mission, ledger, files, unmet, advice)


def _interrupt(mission: Mission, number: int) -> None:
    """Stop at the next safe point; immediately on a second signal or after PATIENCE. The first
    SIGALRM ends the run at its time limit."""
    if number == signal.SIGALRM and mission.ending:
        return
    if mission.stopping:
        raise KeyboardInterrupt
    if number == signal.SIGALRM:
        mission.check_time_limit()
        return
    mission.stop()
    signal.setitimer(signal.ITIMER_REAL, PATIENCE)


def _reported(
    mission: Mission, ledger: Ledger, files: Files, unmet: Sequence[str], advice: bool
) -> int:
    """Print the differences from what the scenario expects (``unmet``: further ones) and the next
    steps; return the exit code."""
    assert mission.result is not None
    plan, result = mission.scenario, mission.result
    outcome, expected = result.outcome, plan.expect
    interrupted = outcome is Outcome.INTERRUPTED
    compares = not interrupted or expected.outcome is outcome
    wrong = [*differences(expected, ledger, plan.map.word), *unmet] if compares else []
    if files.as_json:
        data = measured(plan.name, result, ledger)
        data |= {"as_expected": not wrong if compares else None, "differences": wrong}
        click.echo(json.dumps(data, indent=2))
    for difference in wrong:
        click.echo(f"{click.style('not as expected:', fg='red')} {difference}", err=True)
    status = exit_code_of(outcome)
    if not interrupted and wrong:
        status = status or ExitCode.NEGATIVE
    elif not interrupted and expected.outcome is not None:
        status = ExitCode.OK
    if not files.as_json:
        notes = [*_not_reached(mission)] if outcome is Outcome.COMPLETED else []
        if expected != Expect() and not compares:
            notes.append("note: interrupted: not compared with 'expect'")
        if advice and status in (ExitCode.NEGATIVE, ExitCode.RESOURCE_LIMIT):
            notes += [f"    {line}" for line in _next_steps(outcome, files)]
        for line in notes:
            click.echo(line, err=True)
    return status


def _not_reached(mission: Mission) -> Iterator[str]:
    """Yield a message for each change that was due only after the run had been completed."""
    plan, result = mission.scenario, mission.result
    assert result is not None
    live = plan.clock is Clock.LIVE
    for change in plan.changes:
        if change.at > ((result.makespan or 0.0) if live else result.ticks):
            when = f"at {change.at} s" if live else f"at tick {change.at}"
            yield f"note: completed before the change of {change.robot} {when}"


def _next_steps(outcome: Outcome, files: Files) -> Iterator[str]:
    """Yield commands that show the cause of the outcome."""
    name = quote(str(files.scenario))
    if files.html is not None:
        yield f"view: open {quote(str(files.html))} (starts at the last tick)"
    elif files.trace is not None:
        yield f"view: safenav replay {quote(str(files.trace))}"
    else:
        yield f"view: safenav run {name} --html {quote(files.scenario.stem)}.html"
    if outcome in (Outcome.UNREALIZABLE, Outcome.OPERATOR_NEEDED):
        yield f"explain: safenav explain {name}"
    elif outcome is Outcome.TICK_LIMIT:
        yield f"run longer: safenav run {name} --max-ticks N"


Lines = list[tuple[str, str]]
"""The position of each line (file and number), and the line."""


def run_with_operator(mission: Mission, source: str) -> None:
    """Run a mission; when it waits, take interventions from the file ``source`` (TERMINAL: the
    terminal). Ctrl-C ends the mission. Raises UsageError for a line that is not an intervention, or
    is impossible; at the terminal, the error is printed instead."""
    batches = None if source == TERMINAL else _batches(Path(source), mission.scenario)
    terminal, passes = _Terminal(mission), 0
    mission.start()
    try:
        while mission.result is None:
            passes = passes + 1 if mission.waiting is not None else 0
            if mission.waiting is not None and (mission.still or passes > PASSES):
                passes = 0
                if batches is None:
                    _ask(mission, terminal)
                else:
                    _apply(mission, next(batches, [("", "give_up")]))
            if mission.result is None:
                mission.step()
    except KeyboardInterrupt:
        mission.give_up()
    except UsageError as error:
        mission.give_up(str(error))  # so that its trace has an end
        raise
    left = [each for lines in batches or () for each in lines]
    if left:
        (place, line), more = left[0], f" and {len(left) - 1} more" if len(left) > 1 else ""
        click.echo(f"note: the run ended before {place}: {line}{more}", err=True)


class _Terminal:
    """Lines of standard input. The mission continues until a line arrives: robots end their
    commands, and Ctrl-C ends the run."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission
        self._read = b""
        self._over = False

    def line(self, *, stepping: bool) -> str | None:
        """Return the next line without its end; None at the end of the input, of the mission or of
        its wait. ``stepping``: let the mission continue meanwhile."""
        while b"\n" not in self._read and not self._over:
            if self.mission.result is not None or self.mission.waiting is None:
                return None
            if select([sys.stdin], [], [], POLL)[0]:
                found = os.read(sys.stdin.fileno(), 4096)
                self._read, self._over = self._read + found, not found
            elif stepping or self.mission.stopping:
                self.mission.step()
        line, _, self._read = self._read.partition(b"\n")
        return line.decode(errors="replace").strip() if line or not self._over else None


def _apply(mission: Mission, lines: Lines) -> None:
    for place, line in lines:
        try:
            mission.intervene(line)
        except UsageError as error:  # robots are in transit: the run continues
            warn(f"{place}: dropped: {error}")
            mission.intervene(line, late=True)


def _batches(path: Path, scenario: Scenario) -> Iterator[Lines]:
    """Return the interventions of each wait, which empty lines separate. They are checked against
    the scenario before the run, since an error would end it."""
    from safenav.runtime.interventions import LINES, read_intervention

    try:
        lines = read_file(path).decode("utf-8").splitlines()
    except OSError as error:
        raise UsageError(f"--operator {path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        byte = f"byte 0x{error.object[error.start]:02X}"
        raise UsageError(f"--operator {path}: not UTF-8: {byte}") from error
    found: list[Lines] = [[]]
    for number, line in enumerate(lines, 1):
        command = re.split(r"(?:^|\s)#", line, maxsplit=1)[0].strip()  # not crate@47#2
        if command:
            try:
                if command.split()[0] not in LINES:
                    known = "; ".join(LINES.values())
                    raise UsageError(f"'{command[:60]}' is not an intervention; known: {known}")
                _check_type(read_intervention(command, scenario), scenario)
            except UsageError as error:
                raise UsageError(f"{path}:{number}: {error}") from error
            found[-1].append((f"{path}:{number}", command))
        elif not line.strip() and found[-1]:
            found.append([])
    return iter([batch for batch in found if batch])


def _check_type(wanted: Intervention, scenario: Scenario) -> None:
    """Raise UsageError if an intervention names an obstacle whose type does not exist."""
    from safenav.runtime.interventions import MarkPermanent, MarkResolved
    from safenav.scenario.model import name_parts

    if not isinstance(wanted, MarkResolved | MarkPermanent):
        return
    kind = name_parts(wanted.obstacle)[0]
    types = {*scenario.catalogue.obstacles, *(each.type.name for each in scenario.obstacles)}
    types |= set() if scenario.flat is None else {scenario.flat.name}
    if kind not in types and not kind.startswith(("lost_", "unknown_")):
        known = ", ".join(sorted(types))
        raise UsageError(f"there is no obstacle type '{kind[:40]}'; known: {known}")


def _ask(mission: Mission, terminal: _Terminal) -> None:
    """Prompt for interventions until an empty line follows one; the end of the input gives up the
    run."""
    from safenav.runtime.interventions import LINES

    conclusion = mission.waiting
    assert conclusion is not None
    lines = [f"because {link}" for link in conclusion.links[1:]]
    lines += [f"interventions: {'; '.join(LINES.values())}", "an empty line continues the run"]
    for line in lines:
        click.echo(f"           {line}", err=True)
    given = 0
    while mission.result is None:
        click.echo("operator> ", nl=False, err=True)
        command = terminal.line(stepping=not given)
        if mission.result is None and mission.waiting is None:
            click.echo("\n           something has changed: the run continues", err=True)
        if mission.result is not None or mission.waiting is None:
            return
        if not command and command is not None:
            if given:
                return
            continue
        try:
            mission.intervene(command or "give_up")
            given += 1
        except UsageError as error:
            click.echo(f"           {error}", err=True)
        if command is None:
            return
