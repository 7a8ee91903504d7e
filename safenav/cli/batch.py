"""``safenav batch``: run many scenarios and report those that do not end as expected."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import click

from safenav.cli import options
from safenav.errors import ExitCode, UsageError
from safenav.files import printable, write_out
from safenav.report.terminal.layout import echo_lines
from safenav.trace.words import counted

EXAMPLES = """\
  mkdir suite && safenav new suite/door.yaml && safenav new suite/team.yaml --template team
  safenav batch suite --jobs 2 --junit report.xml --out before
  safenav batch 'suite/**/d*.yaml'
  safenav batch suite --out before --resume
\b
A PATH is a scenario, a folder (without its folders 'invalid' and 'unrealizable'),
a quoted pattern, a matrix file (docs/batch.md), or - (standard input).
After an interruption, --resume with the same --out continues.
"""
PASSED = "all as expected (without 'expect': completed in time, no order open)"
FAILED = "a case failed or was not run"


@options.command(EXAMPLES, PASSED, FAILED)
def batch(
    paths: Annotated[tuple[str, ...], click.Path()],
    *,
    jobs: Annotated[int | None, options.COUNT, "-j --jobs N", "Scenarios run in parallel."],
    time_limit: Annotated[float, options.SECONDS, "End a scenario after this time."] = 600.0,
    certify: Annotated[Path | None, options.FOLDER, "Write the bundle of each run here."],
    junit: Annotated[Path | None, options.Output(".xml"), "Write a JUnit report (XML)."],
    as_json: options.AsJson,
    out: Annotated[
        Path | None,
        options.FOLDER,
        "-o --output --out",
        "Write results.jsonl, and the trace of each failure.",
    ],
    resume: Annotated[bool, "Run only cases that have no result in --out or have changed."],
    dask: Annotated[str | None, "--dask ADDRESS", "Run on this Dask cluster."],
) -> int:
    """Run every scenario that the PATHs name, in worker processes, and compare each run with
    the scenario's 'expect'."""
    if resume and out is None:
        raise UsageError("--resume needs --out: the folder that holds the results so far")
    if dask is not None and jobs is not None:
        raise UsageError("--jobs is for this machine; a Dask cluster has its own workers")
    from safenav.batch.case import Conditions
    from safenav.batch.pool import DaskCluster, Pool, processors
    from safenav.batch.search import find_cases
    from safenav.batch.session import ResultsFile, run_batch
    from safenav.report.batch import FailureFolder, ProgressLine, report_data, summary, to_junit

    found = find_cases(paths)
    if found.skipped:
        what = counted(len(found.skipped), "YAML file")
        some = printable(", ".join(found.skipped[:3])) + ", ..." * (len(found.skipped) > 3)
        note = "(to run a matrix file, name it)"
        click.echo(f"skipped {what} without a scenario: {some} {note}", err=True)
    bundles = None if certify is None else str(certify.resolve())
    conditions = Conditions(time_limit, bundles)
    with ExitStack() as stack:
        pool = DaskCluster(dask, conditions) if dask else Pool(jobs or processors(), conditions)
        stack.callback(pool.close)
        kept = failures = None
        if out is not None:
            names = [case.name for case in found.cases]
            kept = stack.enter_context(ResultsFile(out, resume=resume, cases=names))
            done = {case.fingerprint for case in found.cases}
            failures = FailureFolder(out, [r for f, r in kept.former.items() if f in done])
        progress = ProgressLine()
        report = run_batch(found.cases, pool, kept=kept, artifacts=failures, progress=progress)
    progress.clear()
    if junit is not None:
        write_out(junit, to_junit(report), echo=False)
    if as_json:
        options.print_json(report_data(report))
    err = as_json or str(junit) == "-"
    echo_lines(summary(report), err=err)
    if report.left and out is not None:
        click.echo(
            f"to continue, repeat with --resume (left: {counted(report.left, 'case')})", err=True
        )
    if report.interrupted:
        return ExitCode.INTERRUPTED
    return options.code_of(report.as_expected)
