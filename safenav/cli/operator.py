"""The operator of a live run: interventions from standard input."""

import os
import sys
from select import select

import click

from safenav.errors import UsageError
from safenav.runtime.run.mission import Mission
from safenav.scenario.model import Clock, Scenario

PASSES = 200
"""Maximum number of passes before the prompt in which commands may end."""
POLL = 0.05
"""Seconds between two checks for input."""


def attended(wanted: bool, plan: Scenario, as_json: bool) -> bool:
    """Return whether to prompt an operator: if ``wanted``, or if a user is at a terminal. Raises
    UsageError if an operator is wanted in a run that never waits."""
    live = plan.clock is Clock.LIVE
    if wanted and not live:
        raise UsageError("--operator requires a live run; add '--clock live'")
    return wanted or (live and not as_json and sys.stdin.isatty() and sys.stderr.isatty())


def run_with_operator(mission: Mission) -> None:
    """Run a mission. When it waits, prompt for interventions."""
    terminal, passes = _Terminal(mission), 0
    mission.start()
    while mission.result is None:
        passes = passes + 1 if mission.waiting is not None else 0
        if mission.waiting is not None and (mission.still or passes > PASSES):
            passes = 0
            _ask(mission, terminal)
        if mission.result is None:
            mission.step()


class _Terminal:
    """Lines of standard input. The mission continues until a line arrives: robots end their
    commands. Ctrl-C ends the run."""

    def __init__(self, mission: Mission) -> None:
        self.mission = mission
        self._read = b""
        self._over = False

    def line(self, *, stepping: bool) -> str | None:
        """Return the next line, stripped; None if the input, the mission or its wait for an
        operator has ended. ``stepping``: whether the mission continues until the line arrives."""
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


def _ask(mission: Mission, terminal: _Terminal) -> None:
    """Prompt for interventions until an empty line or the end of the input follows one. Give up the
    run if the input ends before any intervention."""
    from safenav.runtime.run.operator import LINES

    for line in (f"interventions: {'; '.join(LINES.values())}", "an empty line continues the run"):
        click.echo(f"           {line}", err=True)
    given = 0
    while mission.result is None:
        click.echo("operator> ", nl=False, err=True)
        command = terminal.line(stepping=not given)
        if mission.result is None and mission.waiting is None:
            click.echo("\n           the wait has ended: the run continues", err=True)
        if mission.result is not None or mission.waiting is None:
            return
        if not command and (given or command is None):
            if not given:
                mission.intervene("give_up")
            return
        try:
            if command:
                mission.intervene(command)
                given += 1
        except UsageError as error:
            click.echo(f"           {error}", err=True)
