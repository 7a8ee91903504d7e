"""``safenav motion``: a run in metres and seconds."""

from __future__ import annotations

from pathlib import Path

import click

from safenav.cli.options import FiniteRange
from safenav.cli.output import FILE
from safenav.errors import ExitCode

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav run lab.yaml --trace lab.jsonl
  safenav motion lab.jsonl -o lab.motion.jsonl
  safenav motion lab.jsonl --report
  safenav motion lab.jsonl -o windy.jsonl --gust 1 --push 0.1 --seed 7 --report
  safenav check-motion lab.motion.jsonl lab.jsonl
\b
Exit codes:
  0  done   2  invalid trace or usage, or infeasible motion
"""


@click.command(epilog=EPILOG)
@click.argument("trace", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=FILE, help="File to write; - is standard output.")
@click.option(
    "--side",
    type=FiniteRange(min=0, min_open=True, max=1e6),
    metavar="M",
    help="Side of a region in metres; default: as in the trace, else 2.7.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Seed of the disturbances.")
@click.option(
    "--gust",
    type=FiniteRange(min=0),
    default=0.0,
    metavar="M/S",
    help="Wind on flyers, root mean square; their flight is simulated.",
)
@click.option(
    "--push",
    type=FiniteRange(min=0),
    default=0.0,
    metavar="M/S",
    help="Pushes on walkers, once per move, by up to this change of velocity.",
)
@click.option("--report", is_flag=True, help="Print times, waiting, distances, errors, margins.")
def command(
    trace: Path,
    output: Path | None,
    side: float | None,
    seed: int,
    gust: float,
    push: float,
    report: bool,
) -> int:
    """Compute the motion of TRACE: how each robot moves in metres and seconds, so that every
    guarantee of the run holds at every instant."""
    from safenav.motion.file.writing import text_of
    from safenav.motion.making import SIDE, Disturbances, motion_of
    from safenav.motion.report import report_of
    from safenav.outfile import write_bytes
    from safenav.trace.reading import read_trace

    if output is None and not report:
        raise click.UsageError("nothing to do: give -o FILE, --report, or both")
    run = read_trace(trace)
    if side is None and run.header.scenario.map.resolution is None:
        click.echo(
            f"{trace}: no region size given; using {SIDE:g} m (change with --side M)",
            err=True,
        )
    motion = motion_of(run, side, Disturbances(seed, gust, push))
    if output is not None:
        write_bytes(output, text_of(motion).encode())
    if report:
        click.echo(report_of(motion), err=str(output) == "-")
    return ExitCode.OK
