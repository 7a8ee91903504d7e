"""A run at the terminal: its listeners, its interruption, and the report of its end."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from shlex import quote
from typing import Any

import click
from msgspec.structs import replace

from safenav.batch.expectation import Ledger, differences
from safenav.cli.operator import TERMINAL, run_with_operator
from safenav.errors import ExitCode, UsageError, exit_code_of
from safenav.outcome import Outcome
from safenav.runtime.run.mission import Mission, RunResult
from safenav.scenario.model import Scenario
from safenav.scenario.settings import Clock, Expect
from safenav.trace.writing import Listener, TraceWriter

PATIENCE = 0.8
"""Seconds after the first signal until a run that does not react is ended."""

MOST_STATES = 20_000
"""Maximum number of states of a strategy that is examined after a run has reached a limit."""

MakeMission = Callable[[Scenario, list[Listener]], Mission]
"""Makes the mission of a scenario with these listeners."""


class RunSession:
    """A mission, with its trace and its report.

    ``trace``: its file; if None, ``temporary`` names a trace that exists until the stack is closed
    (None: no trace). ``views``: further listeners.
    """

    def __init__(
        self,
        make: MakeMission,
        stack: ExitStack,
        trace: Path | None,
        *,
        temporary: str | None = None,
        as_json: bool = False,
        maps: bool = True,
        views: Sequence[Listener] = (),
    ) -> None:
        self._make, self._stack, self._views = make, stack, views
        self._as_json, self._maps = as_json, maps
        self._kept = trace is not None
        if trace is None and temporary is not None:
            from tempfile import TemporaryDirectory

            trace = Path(stack.enter_context(TemporaryDirectory())) / temporary
        self.trace = trace
        self.ledger = Ledger()

    def begin(self, plan: Scenario) -> None:
        """Make the mission of a scenario."""
        listeners: list[Listener] = [self.ledger]
        if self.trace is not None:
            listeners.append(self._stack.enter_context(TraceWriter(self.trace)))
        if not self._as_json:
            from safenav.report.terminal.fold import terminal_width
            from safenav.report.terminal.story import Story

            story = Story(plan, maps=self._maps, width=terminal_width())
            listeners.append(story)
        self.mission = self._make(plan, [*listeners, *self._views])

    def run(self, operator: str | None) -> None:
        """Run the mission to its end. ``operator``: the source of interventions."""
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGALRM):
            signal.signal(number, lambda number, _: _interrupt(self.mission, number))
        plan = self.mission.scenario
        wall = plan.limits.seconds if plan.clock is Clock.LOCKSTEP else None
        signal.setitimer(signal.ITIMER_REAL, wall or 0, PATIENCE)
        if operator is None:
            self.mission.run()
        else:
            run_with_operator(self.mission, operator, helping=not self._as_json)
        signal.setitimer(signal.ITIMER_REAL, 0)

    def report(
        self, scenario: Path | None, html: Path | None = None, unmet: Sequence[str] = ()
    ) -> int:
        """Print the differences from what the scenario expects (``unmet``: further ones) and the
        next steps; return the exit code. ``scenario``: the file that next steps name; None: no next
        steps."""
        assert self.mission.result is not None
        plan, outcome = self.mission.scenario, self.mission.result.outcome
        expected, interrupted = plan.expect, outcome is Outcome.INTERRUPTED
        compares = not interrupted or expected.outcome is outcome
        wrong = [*differences(expected, self.ledger, plan.map.word), *unmet] if compares else []
        if self._as_json:
            as_expected = not wrong if compares else None
            compared = {"as_expected": as_expected, "differences": wrong}
            click.echo(json.dumps(self.record() | compared, indent=2))
        for difference in wrong:
            click.echo(f"{click.style('not as expected:', fg='red')} {difference}", err=True)
        if outcome is Outcome.COMPLETED and not self._as_json:
            for line in _not_reached(plan, self.mission.result):
                click.echo(f"note: {line}", err=True)
        if expected != Expect() and not compares and not self._as_json:
            click.echo("note: interrupted: not compared with 'expect'", err=True)
        status = exit_code_of(outcome)
        if not interrupted and wrong:
            status = status or ExitCode.NEGATIVE
        elif not interrupted and expected.outcome is not None:
            status = ExitCode.OK
        ended_badly = status in (ExitCode.NEGATIVE, ExitCode.RESOURCE_LIMIT)
        if ended_badly and scenario is not None and not self._as_json:
            for line in self._next_steps(outcome, scenario, html):
                click.echo(f"    {line}", err=True)
        return status

    def _next_steps(self, outcome: Outcome, scenario: Path, html: Path | None) -> list[str]:
        """Return commands that show the cause of the outcome."""
        name = quote(str(scenario))
        if html is not None:
            steps = [f"view: open {quote(str(html))} (starts at the last tick)"]
        elif self.trace is not None and self._kept:
            steps = [f"view: safenav replay {quote(str(self.trace))}"]
        else:
            steps = [f"view: safenav run {name} --html {quote(scenario.stem)}.html"]
        if outcome in (Outcome.UNREALIZABLE, Outcome.OPERATOR_NEEDED):
            steps.append(f"explain: safenav explain {name}")
        elif outcome is Outcome.TICK_LIMIT:
            steps.append(f"run longer: safenav run {name} --max-ticks N")
        if outcome in (Outcome.TICK_LIMIT, Outcome.TIME_LIMIT):
            vacuous = " and ".join(self._vacuous())
            advice = f"check: safenav check {name} ({vacuous} may win by breaking assumptions)"
            steps += [advice] if vacuous else []
        return steps

    def _vacuous(self) -> Iterator[str]:
        """Yield the robots whose strategies may win without meeting their objectives."""
        # Imported here, since most runs do not need it.
        from safenav.explain.vacuity import vacuities
        from safenav.synthesis.strategy import Strategy

        for name, controller in self.mission.controllers.items():
            strategy = controller.result.strategy
            if not isinstance(strategy, Strategy) or len(strategy.states) > MOST_STATES:
                continue
            if vacuities(strategy):
                yield name

    def record(self) -> dict[str, Any]:
        """Return the result as data."""
        result, ledger = self.mission.result, self.ledger
        assert result is not None
        return {
            "scenario": self.mission.scenario.name,
            "outcome": result.outcome.value,
            "explanation": result.explanation,
            "cause": result.cause,
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


def limited(plan: Scenario, ticks: int | None, seconds: float | None) -> Scenario:
    """Return the scenario with the limits of the command line."""
    limits = plan.limits
    ticks = limits.ticks if ticks is None else ticks
    seconds = limits.seconds if seconds is None else seconds
    return replace(plan, limits=replace(limits, ticks=ticks, seconds=seconds))


def attendant(given: str | None, live: bool, as_json: bool) -> str | None:
    """Return the source of interventions: the given file, or TERMINAL if a user can answer there;
    None: no operator. Raises UsageError for a file without a live run."""
    if given is not None and not live:
        raise UsageError("--operator helps live runs only; add '--clock live'")
    if given is None and live and not as_json and sys.stdin.isatty() and sys.stderr.isatty():
        return TERMINAL
    return given


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


def _not_reached(plan: Scenario, result: RunResult) -> Iterator[str]:
    """Yield a message for each change that was due only after the run had been completed."""
    live = plan.clock is Clock.LIVE
    end = (result.makespan or 0.0) if live else result.ticks
    for change in plan.changes:
        if change.at > end:
            when = f"at {change.at} s" if live else f"at tick {change.at}"
            yield f"completed before the change of {change.robot} {when}"
