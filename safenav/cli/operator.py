"""Interventions of an operator, from the terminal or a file, in live runs that wait for them."""

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
from safenav.lines import read_file

if TYPE_CHECKING:
    from safenav.runtime.intervention.kinds import Intervention
    from safenav.runtime.run.mission import Mission, RunResult
    from safenav.scenario.model import Scenario

TERMINAL = "-"
HELP_SECONDS = 10.0
"""Maximum wall time in seconds for trying repairs."""
PASSES = 200
"""Maximum number of passes for commands to end before the operator is prompted."""

POLL = 0.05
"""Seconds between two checks for terminal input."""

Lines = list[tuple[str, str]]
"""The position of each line (file and number), and the line."""


def run_with_operator(mission: Mission, source: str, *, helping: bool) -> None:
    """Run a mission; when it waits, take interventions from the file ``source`` (TERMINAL: the
    terminal). ``helping``: print the repairs that were tried. Ctrl-C ends the mission. Raises
    UsageError for a line that is not an intervention, or is impossible; at the terminal, the error
    is printed instead."""
    batches = None if source == TERMINAL else _batches(Path(source), mission.scenario)
    try:
        _run(mission, batches, _Terminal(mission), helping=helping)
    except UsageError as error:
        mission.give_up(str(error))  # so that its trace has an end
        raise
    _report_unused(batches)


def _report_unused(batches: Iterator[Lines] | None) -> None:
    """Print a note if the run has ended before some lines of its file."""
    left = [each for lines in batches or () for each in lines]
    if left:
        (place, line), more = left[0], f" and {len(left) - 1} more" if len(left) > 1 else ""
        click.echo(f"note: the run ended before {place}: {line}{more}", err=True)


def _run(
    mission: Mission, batches: Iterator[Lines] | None, terminal: _Terminal, *, helping: bool
) -> RunResult:
    """Run a mission to its end."""
    mission.start()
    passes = 0
    try:
        while mission.result is None:
            passes = passes + 1 if mission.waiting is not None else 0
            if mission.waiting is not None and (mission.still or passes > PASSES):
                passes = 0
                if batches is None:
                    _ask(mission, terminal, helping=helping)
                else:
                    _apply(mission, next(batches, [("", "give_up")]))
            if mission.result is None:
                mission.step()
    except KeyboardInterrupt:
        return mission.give_up()
    return mission.result


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
    from safenav.runtime.intervention.reading import read_intervention

    for place, line in lines:
        try:
            wanted = read_intervention(line, mission.scenario)
        except UsageError as error:
            raise UsageError(f"{place}: {error}") from error
        try:
            mission.intervene(wanted)
        except UsageError as error:  # robots are in transit: the run continues
            warn(f"{place}: dropped: {error}")
            mission.intervene(wanted, late=True)


def _known(wanted: Intervention, scenario: Scenario) -> None:
    """Raise UsageError if an intervention names an obstacle whose type does not exist."""
    from safenav.runtime.intervention.kinds import MarkPermanent, MarkResolved
    from safenav.scenario.model import name_parts

    if not isinstance(wanted, MarkResolved | MarkPermanent):
        return
    kind = name_parts(wanted.obstacle)[0]
    types = {*scenario.catalogue.obstacles, *(each.type.name for each in scenario.obstacles)}
    types |= set() if scenario.flat is None else {scenario.flat.name}
    if kind not in types and not kind.startswith(("lost_", "unknown_")):
        known = ", ".join(sorted(types))
        raise UsageError(f"there is no obstacle type '{kind[:40]}'; known: {known}")


def _batches(path: Path, scenario: Scenario) -> Iterator[Lines]:
    """Return the interventions of each wait, which empty lines separate. They are checked against
    the scenario before the run, since an error would end it."""
    from safenav.runtime.intervention.reading import LINES, read_intervention

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
        if command and command.split()[0] not in LINES:
            known = "; ".join(LINES.values())
            raise UsageError(
                f"{path}:{number}: '{command[:60]}' is not an intervention; known: {known}"
            )
        if command:
            try:
                _known(read_intervention(command, scenario), scenario)
            except UsageError as error:
                raise UsageError(f"{path}:{number}: {error}") from error
            found[-1].append((f"{path}:{number}", command))
        elif not line.strip() and found[-1]:
            found.append([])
    return iter([batch for batch in found if batch])


def _ask(mission: Mission, terminal: _Terminal, *, helping: bool) -> None:
    """Prompt for interventions until an empty line follows one; the end of the input gives up the
    run."""
    from safenav.runtime.intervention.reading import LINES, read_intervention

    conclusion = mission.waiting
    assert conclusion is not None
    for link in conclusion.links[1:]:
        click.echo(f"           because {link}", err=True)
    for repair in repairs_of(mission) if helping else ():
        click.echo(f"           tried: {repair}", err=True)
    known = "; ".join(LINES.values())
    click.echo(f"           interventions: {known}", err=True)
    click.echo("           an empty line continues the run", err=True)
    given = 0
    while mission.result is None:
        click.echo("operator> ", nl=False, err=True)
        command = terminal.line(stepping=not given)
        if mission.result is None and mission.waiting is None:
            click.echo("\n           something has changed: the run continues", err=True)
        if mission.result is not None or mission.waiting is None:
            return
        if command is None or command == "give_up":
            mission.intervene(read_intervention("give_up", mission.scenario))
            return
        if not command and given:
            return
        if not command:
            continue
        try:
            mission.intervene(read_intervention(command, mission.scenario))
            given += 1
        except UsageError as error:
            click.echo(f"           {error}", err=True)


def repairs_of(mission: Mission) -> Iterator[str]:
    """Yield, in words, the repairs with which a simulated run from the present state completes."""
    from safenav.review.postmortem import explain_run
    from safenav.runtime.run.mission import default_synthesizer

    scenario = mission.rest()
    found = explain_run(
        scenario, scenario.catalogue.robots, lambda: default_synthesizer(scenario), HELP_SECONDS
    )
    for repair in found.repairs:
        changes = "; ".join(f"{item}: {value}" for item, value in repair.change)
        yield f"{changes} (a run was completed after {repair.ticks} ticks)"
