"""The operator of a live run: interventions from a terminal or a file."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from select import select
from typing import TYPE_CHECKING

import click

from safenav.cli import warn
from safenav.errors import UsageError
from safenav.files import read_file
from safenav.runtime.run.mission import Mission
from safenav.scenario.model import Clock, Scenario

if TYPE_CHECKING:
    from safenav.runtime.interventions import Intervention

TERMINAL = "-"
PASSES = 200
"""Maximum number of passes for commands to end before the operator is prompted."""
POLL = 0.05
"""Seconds between two checks for terminal input."""


def attendant(given: str | None, plan: Scenario, as_json: bool) -> str | None:
    """Return the source of interventions: the given file, or TERMINAL if a user can answer there;
    None: no operator. Raises UsageError for a file without a live run."""
    live = plan.clock is Clock.LIVE
    if given is not None and not live:
        raise UsageError("--operator helps live runs only; add '--clock live'")
    if given is None and live and not as_json and sys.stdin.isatty() and sys.stderr.isatty():
        return TERMINAL
    return given


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
