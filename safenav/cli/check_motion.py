"""``safenav check-motion``: check a motion against its trace."""

from __future__ import annotations

import json
from pathlib import Path

import click
from msgspec import to_builtins

from safenav.errors import ExitCode

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl --motion lab.motion.jsonl
  safenav check-motion lab.motion.jsonl lab.jsonl
  safenav check-motion --all lab.motion.jsonl lab.jsonl
  safenav check-motion lab.motion.jsonl lab.jsonl --require 'distance(drone, walker) > 1'
\b
Exit codes:
  0  no rule is broken, each requirement is satisfied
  1  a rule is broken, or a requirement is violated or undecided
  2  invalid motion, trace or requirement
"""


@click.command(name="check-motion", epilog=EPILOG)
@click.argument("motion", type=click.Path(path_type=Path))
@click.argument("trace", type=click.Path(path_type=Path))
@click.option("--all", "show_all", is_flag=True, help="Print every broken rule.")
@click.option(
    "--require",
    "more",
    metavar="FORMULA",
    multiple=True,
    help="Also check this requirement (signal temporal logic, docs/motion.md).",
)
@click.option(
    "--rate",
    type=click.FloatRange(min=0, min_open=True, max=10_000),
    default=50.0,
    show_default=True,
    metavar="HZ",
    help="Samples per second for requirements.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the whole result as JSON.")
def command(
    motion: Path, trace: Path, show_all: bool, more: tuple[str, ...], rate: float, as_json: bool
) -> int:
    """Check a MOTION file against the TRACE that it carries out: continuity, dynamics, feet,
    room, reservations, order, actions and distances are recomputed. The measured ways of a drive
    are checked as well. Then the requirements of the scenario are evaluated."""
    from safenav.motion.check.execution import trackings
    from safenav.motion.check.verdict import check_motion
    from safenav.motion.file.reading import read_motion
    from safenav.motion.requirements import SATISFIED, MotionRecording, judged, requirements_of
    from safenav.trace.reading import read_trace
    from safenav.trace.words import counted

    run = read_trace(trace)
    moved = read_motion(motion)
    found = check_motion(moved, run)
    formulas = requirements_of(run, more)
    # A motion that breaks rules has no signals to rely on.
    judgements = [] if found else judged(MotionRecording(moved, run, rate), formulas)
    ok = not found and all(one.verdict == SATISFIED for one in judgements)
    if as_json:
        data = {"ok": ok, "findings": [to_builtins(finding) for finding in found]}
        data["execution"] = [] if found else [to_builtins(one) for one in trackings(moved, run)]
        data["requirements"] = [one.data() for one in judgements]
        click.echo(json.dumps(data, indent=2))
        return ExitCode.OK if ok else ExitCode.NEGATIVE
    for finding in found if show_all else found[:1]:
        click.echo(f"{motion}: {finding}")
    if len(found) > 1 and not show_all:
        click.echo(f"and {len(found) - 1} more (--all shows them)")
    if found and formulas:
        click.echo("the requirements are not evaluated on a motion that breaks rules")
    if not found:
        robots = counted(len(moved.header.robots), "robot")
        seconds = moved.outcome.makespan
        click.echo(f"{motion}: no rule broken in {seconds:.1f} s of {robots}")
        for tracking in trackings(moved, run):
            click.echo(str(tracking))
    for one in judgements:
        click.echo(str(one))
    return ExitCode.OK if ok else ExitCode.NEGATIVE
