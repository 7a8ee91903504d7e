"""An operator at the terminal or in a file, for live runs that wait for one."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from safenav.errors import UsageError

if TYPE_CHECKING:
    from safenav.runtime.mission import Mission, RunResult

TERMINAL = "-"
HELP_SECONDS = 10.0
"""Wall time for trying repairs."""
PASSES = 200
"""Passes in which robots that have a command may end it before the operator is asked."""

Lines = list[tuple[str, str]]
"""Where a line stands, and the line."""


def run_with_operator(mission: Mission, source: str, *, helping: bool) -> RunResult:
    """Run a mission; where it waits, take interventions from a file (TERMINAL: the terminal).
    ``helping``: print the repairs that were tried. Raises UsageError for a line that is not an
    intervention, or is impossible; at the terminal it is printed."""
    batches = None if source == TERMINAL else _batches(Path(source))
    mission.start()
    passes = 0
    while mission.result is None:
        passes = passes + 1 if mission.waiting is not None else 0
        if mission.waiting is not None and (mission.still or passes > PASSES):
            passes = 0
            if batches is None:
                _ask(mission, helping=helping)
            else:
                _apply(mission, next(batches, [("", "give_up")]))
        mission.step()
    return mission.result


def _apply(mission: Mission, lines: Lines) -> None:
    from safenav.runtime.intervening import line_read

    for place, line in lines:
        try:
            mission.intervene(line_read(line, mission.state.scenario))
        except UsageError as error:
            raise UsageError(f"{place}: {error}") from error


def _batches(path: Path) -> Iterator[Lines]:
    """The interventions of each wait: lines without an empty one between them."""
    from safenav.runtime.intervening import LINES

    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"--operator {path}: cannot be read: {error}") from error
    found: list[Lines] = [[]]
    for number, line in enumerate(lines, 1):
        told = line.partition("#")[0].strip()
        if told and told.split()[0] not in LINES:
            known = "; ".join(LINES.values())
            raise UsageError(
                f"{path}:{number}: '{told[:60]}' is not an intervention; known: {known}"
            )
        if told:
            found[-1].append((f"{path}:{number}", told))
        elif not line.strip() and found[-1]:
            found.append([])
    return iter([batch for batch in found if batch])


def _ask(mission: Mission, *, helping: bool) -> None:
    """Ask for interventions until an empty line follows one; the end of the input gives up."""
    from safenav.runtime.intervening import LINES, line_read

    conclusion = mission.waiting
    assert conclusion is not None
    for link in conclusion.links[1:]:
        click.echo(f"           because {link}", err=True)
    for repair in repairs_of(mission) if helping else ():
        click.echo(f"           tried: {repair}", err=True)
    click.echo(f"           interventions: {'; '.join(LINES.values())}", err=True)
    click.echo("           an empty line continues the run", err=True)
    given = 0
    while True:
        click.echo("operator> ", nl=False, err=True)
        line = sys.stdin.readline()
        told = line.strip()
        if not line or told == "give_up":
            mission.intervene(line_read("give_up", mission.state.scenario))
            return
        if not told and given:
            return
        if not told:
            continue
        try:
            mission.intervene(line_read(told, mission.state.scenario))
            given += 1
        except UsageError as error:
            click.echo(f"           {error}", err=True)


def repairs_of(mission: Mission) -> Iterator[str]:
    """Return in words the repairs under which the mission was completed from here."""
    from safenav.runtime.mission import default_synthesizer
    from safenav.runtime.postmortem import as_it_stands, explain_run

    scenario = as_it_stands(mission.state)
    found = explain_run(
        scenario, scenario.catalogue.robots, lambda: default_synthesizer(scenario), HELP_SECONDS
    )
    for repair in found.repairs:
        changes = "; ".join(f"{item}: {value}" for item, value in repair.change)
        yield f"{changes} (a run was completed after {repair.ticks} ticks)"
