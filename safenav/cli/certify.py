"""``safenav certify``: write a run with its proofs as a bundle."""

from __future__ import annotations

from pathlib import Path

import click

from safenav.certify.record import bundle_of_run, bundle_of_trace
from safenav.cli import options
from safenav.errors import ExitCode, NotCertifiedError, UsageError
from safenav.report.terminal.fold import echo_folded

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav certify lab.yaml -o bundle
  safenav check bundle && python3 -I -S bundle/check.py bundle
  safenav certify lab.yaml -o lab.zip
  safenav run lab.yaml --trace lab.jsonl --motion lab.motion.jsonl   # extra 'motion'
  safenav certify --trace lab.jsonl --motion lab.motion.jsonl -o moved
\b
Exit codes:
  0  the bundle is written, and its checker accepts it
  1  a checker refuses the run: the reason is printed, no bundle is written
  2  bad input or usage   3  time or memory limit   4  synthesizer failure
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=options.INPUT, required=False)
@click.option("--trace", type=options.INPUT, help="The trace of an earlier run.")
@options.output(".zip", folder=True, required=True, help="A folder, or a .zip.")
@click.option("--motion", type=options.INPUT, help="With --trace: the motion of that run.")
@click.option("--with-motion", is_flag=True, help="Also compute the motion of SCENARIO's run.")
@options.seed
def command(
    scenario: Path | None,
    trace: Path | None,
    output: Path,
    motion: Path | None,
    with_motion: bool,
    seed: int | None,
) -> int:
    """Run SCENARIO and write a bundle: the run, each strategy with its proof, and a checker that
    needs only Python.

    Any outcome can be certified, including that the mission is infeasible."""
    if (scenario is None) == (trace is None):
        raise UsageError("give either a scenario to run, or the --trace of an earlier run")
    if (motion is not None and trace is None) or (with_motion and scenario is None):
        raise UsageError("--motion goes with --trace, --with-motion with a scenario")
    try:
        if scenario is not None:
            made = bundle_of_run(scenario, output, seed=seed, motion=with_motion)
        else:
            assert trace is not None
            made = bundle_of_trace(trace, output, motion)
    except NotCertifiedError as error:
        click.echo(str(error), err=True)
        return ExitCode.NEGATIVE
    echo_folded(f"  {claim['text']}" for claim in made.verdict.claims)
    click.echo(f"{made.path}: {made.files} files, {made.bytes / 1024:.0f} KiB, accepted")
    return ExitCode.OK
