"""``safenav certify`` and ``safenav check-bundle``: write a run with its proofs as a bundle; check
a bundle with the installed checker."""

from __future__ import annotations

import json
from pathlib import Path

import click

from safenav.certify.check import Acceptance
from safenav.certify.check import check_bundle as checked
from safenav.certify.record import bundle_of_run, bundle_of_trace
from safenav.cli import options
from safenav.errors import ExitCode, NotCertifiedError, UsageError
from safenav.report.terminal.fold import echo_folded
from safenav.report.terminal.table import table

EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav certify lab.yaml -o bundle
  python3 -I -S bundle/check.py bundle
  safenav certify lab.yaml -o lab.zip
  safenav run lab.yaml --trace lab.jsonl --motion lab.motion.jsonl   # extra 'motion'
  safenav certify --trace lab.jsonl --motion lab.motion.jsonl -o moved
\b
Exit codes:
  0  the bundle is written, and its checker accepts it
  1  a checker refuses the run: the reason is printed, no bundle is written
  2  bad input or usage   3  time or memory limit   4  synthesizer failure
"""

CHECK_EPILOG = """\b
Examples:
  safenav new lab.yaml && safenav certify lab.yaml -o bundle
  safenav check-bundle bundle
  safenav check-bundle bundle --json
\b
Exit codes:
  0  accepted   1  refused: the first reason is printed   2  not a bundle
  3  too large for the checker
"""


@click.command(epilog=EPILOG)
@click.argument("scenario", type=options.INPUT, required=False)
@click.option("--trace", type=options.INPUT, help="The trace of an earlier run.")
@click.option("-o", "--output", type=options.BUNDLE, required=True, help="A folder, or a .zip.")
@click.option(
    "--motion",
    type=options.INPUT,
    help="With --trace: the motion of that run (safenav motion); it goes into the bundle.",
)
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


@click.command(name="check-bundle", epilog=CHECK_EPILOG)
@click.argument("bundle", type=click.Path(path_type=Path, exists=True))
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def check_bundle(bundle: Path, as_json: bool) -> int:
    """Check a BUNDLE (a folder or a .zip) and print what it establishes, claim by claim.

    This uses the installed checker, not the copy in the bundle. A reviewer without safenav runs
    `python3 -I -S check.py BUNDLE`.
    """
    verdict = checked(bundle)
    claims = [dict(claim) for claim in verdict.claims]
    if as_json:
        data = {"verdict": verdict.result, "reason": verdict.reason, "claims": claims}
        data["not_compared"] = list(verdict.not_compared)
        click.echo(json.dumps(data, indent=2))
    else:
        rows = [(claim["id"], claim["text"]) for claim in claims]
        if rows:
            click.echo("\n".join(table(("claim", "established"), rows)))
        for what in verdict.not_compared:
            click.echo(f"not compared: {what}")
        colour = "green" if verdict.accepted else "red"
        reason = f": {verdict.reason}" if verdict.reason else ""
        click.echo(f"{bundle}: {click.style(verdict.result, fg=colour)}{reason}")
    return {
        Acceptance.ACCEPTED: ExitCode.OK,
        Acceptance.REFUSED: ExitCode.NEGATIVE,
        Acceptance.TOO_LARGE: ExitCode.RESOURCE_LIMIT,
    }[verdict.result]
