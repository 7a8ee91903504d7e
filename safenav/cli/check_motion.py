"""``safenav check-motion``: check a motion against its trace."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import click

from safenav.errors import ExitCode

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl --motion lab.motion.jsonl
  safenav check-motion lab.motion.jsonl lab.jsonl
  safenav check-motion --all lab.motion.jsonl lab.jsonl
\b
Exit codes:
  0  no rule is broken   1  a rule is broken   2  invalid motion or trace
"""


@click.command(name="check-motion", epilog=EPILOG)
@click.argument("motion", type=click.Path(path_type=Path))
@click.argument("trace", type=click.Path(path_type=Path))
@click.option("--all", "show_all", is_flag=True, help="Print every broken rule.")
@click.option("--json", "as_json", is_flag=True, help="Print the whole result as JSON.")
def command(motion: Path, trace: Path, show_all: bool, as_json: bool) -> int:
    """Check a MOTION file against the TRACE that it carries out: continuity, dynamics, feet,
    room, reservations, order, actions and distances are recomputed."""
    from safenav.motion.check.verdict import check_motion
    from safenav.motion.file.reading import read_motion
    from safenav.motion.source import read_source
    from safenav.trace.wording import counted

    source = read_source(trace)
    moved = read_motion(motion)
    found = check_motion(moved, source.trace, source.digest)
    if as_json:
        data = {"ok": not found, "findings": [asdict(finding) for finding in found]}
        click.echo(json.dumps(data, indent=2))
        return ExitCode.NEGATIVE if found else ExitCode.OK
    for finding in found if show_all else found[:1]:
        click.echo(f"{motion}: {finding}")
    if len(found) > 1 and not show_all:
        click.echo(f"and {len(found) - 1} more (--all shows them)")
    if not found:
        robots = counted(len(moved.header.robots), "robot")
        seconds = moved.outcome.makespan
        click.echo(f"{motion}: no rule broken in {seconds:.1f} s of {robots}")
    return ExitCode.NEGATIVE if found else ExitCode.OK
