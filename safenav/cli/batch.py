"""``safenav batch``: run many scenarios and report which are not as expected."""

from __future__ import annotations

import os
import shutil
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from safenav.cli import options
from safenav.errors import ExitCode, UsageError
from safenav.lines import printable
from safenav.outfile import write_out
from safenav.report.terminal.fold import echo_folded, terminal_width

if TYPE_CHECKING:
    from safenav.batch.cases.search import FoundCases
    from safenav.batch.session import Backend
    from safenav.batch.workers.worker import Worker

EPILOG = """\b
Examples:
  mkdir suite && safenav new suite/door.yaml && safenav new suite/team.yaml --template team
  safenav batch suite --jobs 2 --junit report.xml --out out
  safenav batch 'suite/**/d*.yaml' --fail-fast --results before.json
  safenav batch suite --out out --resume
  safenav batch suite --results now.json --baseline before.json
\b
A PATH is a scenario, a folder (without its folders 'invalid' and 'unrealizable'),
a quoted pattern, or a matrix file (docs/batch.md). '-': standard output.
Exit codes:
  0  all as expected (without 'expect': completed)   2  bad input or usage
  1  some not as expected, invalid, crashed, hung or not run
  130  interrupted; `--resume` with the same --out continues
"""


@click.command(epilog=EPILOG)
@click.argument("paths", metavar="PATH...", type=options.TEXT_INPUT, nargs=-1, required=True)
@click.option(
    "-j",
    "--jobs",
    type=click.IntRange(min=1),
    metavar="N",
    help="Scenarios in parallel.  [one per processor]",
)
@click.option(
    "--time-limit",
    type=options.SECONDS,
    default=600.0,
    metavar="S",
    help="End a scenario after so long.  [600]",
)
@click.option("--fail-fast", is_flag=True, help="Stop at the first failure.")
@click.option(
    "--retry-limit",
    type=click.IntRange(min=0),
    default=0,
    metavar="N",
    help="Retries of a failed scenario.  [0]",
)
@options.verify
@click.option(
    "--certify",
    type=options.FOLDER,
    help="Write the bundle of each run into this folder.",
)
@click.option("--junit", type=options.Output(".xml"), help="Write a JUnit report (XML).")
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print all results as JSON.",
)
@click.option("--results", type=options.JSON, help="Write them, for --baseline.")
@click.option("--csv", "as_csv", type=options.Output(".csv"), help="Write the figures as CSV.")
@click.option(
    "-o",
    "--output",
    "--out",
    "out",
    type=options.FOLDER,
    help="Write results, and trace and replay of failures.",
)
@click.option("--resume", is_flag=True, help="Run only cases without a result in --out.")
@click.option(
    "--baseline",
    type=options.INPUT,
    help="Compare with earlier --results.",
)
@click.option(
    "--slower",
    type=options.FiniteRange(min=1),
    default=1.5,
    metavar="X",
    help="Report slower than X times its baseline.  [1.5]",
)
@click.option(
    "--slowest",
    type=click.IntRange(min=0),
    default=10,
    metavar="N",
    help="Passed scenarios in the table.  [10]",
)
@click.option("--dask", metavar="ADDRESS", help="Run on this Dask cluster.")
def command(
    paths: tuple[str, ...],
    jobs: int | None,
    time_limit: float,
    fail_fast: bool,
    retry_limit: int,
    verify: bool,
    certify: Path | None,
    junit: Path | None,
    as_json: bool,
    results: Path | None,
    as_csv: Path | None,
    out: Path | None,
    resume: bool,
    baseline: Path | None,
    slower: float,
    slowest: int,
    dask: str | None,
) -> int:
    """Run every scenario that the PATHs name, each in a process of its own, and compare each
    run with the scenario's 'expect'."""
    if resume and out is None:
        raise UsageError("--resume needs --out: the folder that holds the results so far")
    if dask is not None and jobs is not None:
        raise UsageError("--jobs is for this machine; a Dask cluster has its own workers")
    if as_json and results is None:
        results = Path("-")
    files = [path for path in (junit, results, as_csv) if path is not None]
    with ExitStack() as stack:
        started = [] if dask is not None else [_first_worker(stack)]
        from safenav.batch.baseline import compare
        from safenav.batch.cases.case import Conditions
        from safenav.batch.cases.search import find_cases
        from safenav.batch.journal import StateFile
        from safenav.batch.results_file import read_results, to_csv, to_json
        from safenav.batch.session import run_batch
        from safenav.batch.workers.pool import LocalPool
        from safenav.report.batches.failure import FailureFolder
        from safenav.report.batches.junit import to_junit
        from safenav.report.batches.progress import ProgressLine
        from safenav.report.batches.summary import summary

        former = None if baseline is None else read_results(baseline)
        found = find_cases(paths)
        _report_skipped(found)
        progress = ProgressLine()
        bundles = None if certify is None else str(certify.resolve())
        conditions = Conditions(time_limit, verify, bundles)
        traces = None if out is None else out / ".running-traces"
        backend: Backend
        if dask is not None:
            from safenav.batch.dask_cluster import DaskCluster

            backend = DaskCluster(dask, conditions, traces)
        else:
            backend = LocalPool(jobs or _processors(), conditions, traces, started)
        stack.callback(backend.close)
        state = failures = None
        if out is not None and traces is not None:
            state = stack.enter_context(
                StateFile(out, resume=resume, cases=[c.name for c in found.cases])
            )
            # Remove only files that an earlier batch has written there.
            failures = FailureFolder(out, keep=resume or not state.existed)
            if resume:
                done = {case.fingerprint for case in found.cases}
                failures.keep_only([r for f, r in state.former.items() if f in done])
            _make_empty(traces, stack)
        report = run_batch(
            found.cases,
            backend,
            state=state,
            retries=retry_limit,
            fail_fast=fail_fast,
            artifacts=failures,
            observer=progress,
        )
    progress.clear()
    comparison = None
    if former is not None:
        not_run = [case.name for case in report.not_run]
        comparison = compare(report.in_order, former, slower, not_run)
    if junit is not None:
        write_out(junit, to_junit(report), echo=False)
    if results is not None:
        write_out(results, to_json(report, comparison), echo=False)
    if as_csv is not None:
        write_out(as_csv, to_csv(report), echo=False)
    err = Path("-") in files
    width = terminal_width(sys.stderr if err else sys.stdout)
    echo_folded(summary(report, comparison, slowest, width), err=err)
    if report.left and out is not None:
        click.echo(f"to continue, repeat with --resume ({report.left} cases left)", err=True)
    if report.interrupted:
        return ExitCode.INTERRUPTED
    return ExitCode.OK if report.as_expected else ExitCode.NEGATIVE


def _first_worker(stack: ExitStack) -> Worker:
    """Start a worker, which loads its modules while this process searches for scenarios."""
    from safenav.batch.workers.worker import Worker

    worker = Worker()
    stack.callback(worker.end)
    return worker


def _processors() -> int:
    """Return the number of usable processors; a container often has fewer than the machine."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _make_empty(folder: Path, stack: ExitStack) -> None:
    """Create a folder, or empty it; remove it when the stack is closed."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    stack.callback(shutil.rmtree, folder, ignore_errors=True)


def _report_skipped(found: FoundCases) -> None:
    count = len(found.passed_over)
    if count:
        files = "file that is not a scenario" if count == 1 else "files that are not scenarios"
        names = printable(", ".join(found.passed_over[:3])) + (", ..." if count > 3 else "")
        click.echo(f"skipped {count} YAML {files}: {names}", err=True)
    for matrix in found.matrices:
        note = f"skipped a matrix file: to run it, safenav batch {printable(matrix)}"
        click.echo(note, err=True)
