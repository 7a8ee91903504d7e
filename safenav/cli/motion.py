"""``safenav motion`` and ``safenav check-motion``: a run in metres and seconds, and its check."""

from __future__ import annotations

import json
from pathlib import Path

import click
from msgspec import to_builtins

from safenav.cli import options
from safenav.errors import ExitCode
from safenav.outfile import write_out
from safenav.trace.reading import read_trace
from safenav.trace.words import counted

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl
  safenav motion lab.jsonl -o lab.motion.jsonl
  safenav motion lab.jsonl --report
  safenav motion lab.jsonl -o windy.jsonl --gust 1 --seed 7 --report
  safenav check-motion lab.motion.jsonl lab.jsonl
\b
Exit codes:
  0  done   2  invalid trace or usage, or infeasible motion
"""

CHECK_EPILOG = """\b
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


@click.command(epilog=EPILOG)
@click.argument("trace", type=options.INPUT)
@click.option("-o", "--output", type=options.LINES, help="File to write; - is standard output.")
@click.option(
    "--side",
    type=options.METRES,
    metavar="M",
    help="Side of a region in metres; default: as in the trace, else 2.7.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Seed of the disturbances.")
@click.option(
    "--gust",
    type=options.FiniteRange(min=0),
    default=0.0,
    metavar="M/S",
    help="Root-mean-square wind on flyers; simulates their flight.",
)
@click.option("--report", is_flag=True, help="Print times, waiting, distances, errors, margins.")
def command(
    trace: Path,
    output: Path | None,
    side: float | None,
    seed: int,
    gust: float,
    report: bool,
) -> int:
    """Compute the motion of TRACE: how each robot moves in metres and seconds, so that every
    guarantee of the run holds at every instant."""
    from safenav.motion.file.reading import text_of
    from safenav.motion.making import SIDE, Disturbances, motion_of, refuse_broken
    from safenav.motion.report import report_of

    if output is None and not report:
        raise click.UsageError("nothing to do: give -o FILE, --report, or both")
    run = read_trace(trace)
    if side is None and run.header.scenario.map.resolution is None:
        click.echo(
            f"{trace}: no region size given; using {SIDE:g} m (change with --side M)",
            err=True,
        )
    refuse_broken(run)
    motion = motion_of(run, side, Disturbances(seed, gust))
    if output is not None:
        write_out(output, text_of(motion))
    if report:
        click.echo(report_of(motion), err=str(output) == "-")
    return ExitCode.OK


@click.command(name="check-motion", epilog=CHECK_EPILOG)
@click.argument("motion", type=options.INPUT)
@click.argument("trace", type=options.INPUT)
@options.show_all
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
def check_motion(
    motion: Path, trace: Path, show_all: bool, more: tuple[str, ...], rate: float, as_json: bool
) -> int:
    """Check a MOTION file against its TRACE: recompute continuity, dynamics, footsteps, clearance,
    reservations, order, actions and distances, including the paths measured in a drive. Then
    evaluate the requirements of the scenario."""
    from safenav.motion.check.execution import trackings
    from safenav.motion.check.verdict import check_motion as checked
    from safenav.motion.file.reading import read_motion
    from safenav.motion.requirements import SATISFIED, MotionRecording, judged, requirements_of

    run = read_trace(trace)
    moved = read_motion(motion)
    found = checked(moved, run)
    formulas = requirements_of(run, more)
    # The signals of a motion that breaks rules are not reliable.
    judgements = [] if found else judged(MotionRecording(moved, run, rate), formulas)
    ok = not found and all(one.verdict == SATISFIED for one in judgements)
    if as_json:
        data = {"ok": ok, "findings": [to_builtins(finding) for finding in found]}
        data["execution"] = [] if found else [to_builtins(one) for one in trackings(moved, run)]
        data["requirements"] = [one.data() for one in judgements]
        click.echo(json.dumps(data, indent=2))
        return ExitCode.OK if ok else ExitCode.NEGATIVE
    options.print_findings(motion, found, show_all)
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
