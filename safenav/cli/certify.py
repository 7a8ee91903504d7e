"""``safenav certify``: a run, and everything that proves it, as one bundle."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from safenav.cli import options
from safenav.cli.output import BUNDLE
from safenav.errors import ExitCode, NotCertifiedError, UsageError

if TYPE_CHECKING:
    from safenav.certify.bundle import Made

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav certify lab.yaml -o bundle
  python3 -I -S bundle/check.py bundle
  safenav certify lab.yaml -o lab.zip
  safenav run lab.yaml --trace lab.jsonl --motion lab.motion.jsonl   # extra 'motion'
  safenav certify --trace lab.jsonl --motion lab.motion.jsonl -o moved
\b
With the verified checker (docs/proof.md):
  safenav certify lab.yaml --proved -o proved
\b
Exit codes:
  0  the bundle is written, and its checker accepts it
  1  a checker refuses the run: the reason is printed, no bundle is written
  2  bad input or usage   3  time or memory limit   4  synthesizer failure
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=click.Path(path_type=Path), required=False)
@click.option("--trace", type=click.Path(path_type=Path), help="The trace of an earlier run.")
@click.option("-o", "--output", type=BUNDLE, required=True, help="A folder, or a .zip.")
@click.option(
    "--motion",
    type=click.Path(path_type=Path),
    help="With --trace: the motion of that run (safenav motion); it goes into the bundle.",
)
@click.option("--with-motion", is_flag=True, help="Also compute the motion of SCENARIO's run.")
@click.option("--proved", is_flag=True, help="Also run the proved checker (docs/proof.md).")
@options.seed
def command(
    scenario: Path | None,
    trace: Path | None,
    output: Path,
    motion: Path | None,
    with_motion: bool,
    proved: bool,
    seed: int | None,
) -> int:
    """Run SCENARIO and write a bundle: the run, each strategy with its proof, and a checker that
    needs only Python.

    Any outcome can be certified, including that the mission is impossible."""
    from safenav.certify.record import bundle_of_run, bundle_of_trace

    if (scenario is None) == (trace is None):
        raise UsageError("name a scenario to run, or the --trace of an earlier run")
    if (motion is not None and trace is None) or (with_motion and scenario is None):
        raise UsageError("--motion goes with --trace, --with-motion with a scenario")
    try:
        if scenario is not None:
            made = bundle_of_run(scenario, output, seed=seed, motion=with_motion, proved=proved)
        else:
            assert trace is not None
            made = bundle_of_trace(trace, output, motion, proved=proved)
    except NotCertifiedError as error:
        click.echo(str(error), err=True)
        return ExitCode.NEGATIVE
    _tell(made)
    return ExitCode.OK


def _tell(made: Made) -> None:
    for claim in made.verdict.claims:
        click.echo(f"  {claim['text']}")
    click.echo(f"{made.path}: {made.files} files, {made.bytes / 1024:.0f} KiB, accepted")
