"""Measures slugs binaries: CPU time and peak memory, interleaved, medians and ratios.

    python benchmarks/slugs.py --suite corpus
    python benchmarks/slugs.py --binary ours=slugs/build/slugs --binary theirs=/opt/slugs FILES...

Nothing here is a test: it reports, and a missed bar is a mark in the table.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

import click
from measuring import Summary, count_nodes, interleaved, memory_floor
from suites import Case, Mode, corpus_folder, corpus_suite, families_suite
from table import Row, render

ROOT = Path(__file__).resolve().parents[1]
STRATEGY = ("--explicitStrategy", "--jsonOutput")


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("files", nargs=-1, type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option(
    "--binary",
    "binaries",
    multiple=True,
    metavar="NAME=PATH",
    help="A slugs binary; repeat to compare. Default: slugs=slugs/build/slugs.",
)
@click.option(
    "--slugsin-only",
    multiple=True,
    metavar="NAME",
    help="This binary reads slugsin only: structured files are translated by the first binary.",
)
@click.option("--suite", type=click.Choice(["corpus", "families"]), help="A built-in set of cases.")
@click.option("--only", metavar="TEXT", help="Only the cases whose name contains TEXT.")
@click.option(
    "--mode",
    type=click.Choice(["strategy", "verdict"]),
    default="strategy",
    show_default=True,
    help="What to ask for on FILES.",
)
@click.option("--option", "options", multiple=True, help="Passed on to every binary.")
@click.option("--repeat", type=click.IntRange(1), default=3, show_default=True)
@click.option("--timeout", type=float, default=120, show_default=True, help="Seconds per run.")
@click.option("--count", is_flag=True, help="Also count the nodes of each strategy (one more run).")
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write the figures.")
def main(
    files: tuple[Path, ...],
    binaries: tuple[str, ...],
    slugsin_only: tuple[str, ...],
    suite: str | None,
    only: str | None,
    mode: Mode,
    options: tuple[str, ...],
    repeat: int,
    timeout: float,
    count: bool,
    json_file: Path | None,
) -> None:
    """Measure slugs binaries on FILES or on a suite: CPU seconds, peak memory, ratios.

    \b
    Examples:
      python benchmarks/slugs.py --suite corpus
      python benchmarks/slugs.py --binary new=slugs/build/slugs --binary old=/tmp/slugs *.slugsin

    Exit status: 0 measured, 2 bad usage.
    """
    named = _named(binaries)
    with tempfile.TemporaryDirectory() as folder:
        scratch = Path(folder)
        cases = [Case(file.name, file, mode) for file in files]
        if suite == "corpus":
            cases += corpus_suite(scratch)
            if corpus_folder() is None:
                click.echo("No corpus found (SAFENAV_CORPUS): generated files only.", err=True)
        elif suite == "families":
            cases += families_suite(scratch)
        cases = [case for case in cases if only is None or only in case.name]
        if not cases:
            raise click.UsageError("nothing to measure: give FILES or --suite")
        rows = []
        for case in cases:
            commands = [
                _command(named, name, case, name in slugsin_only, options, scratch)
                for name in named
            ]
            results = interleaved(commands, repeat, timeout, partial(_progress, case))
            nodes = None
            if count and case.mode == "strategy" and results[0].ending == "realizable":
                nodes = count_nodes(commands[0], timeout)
            rows.append(Row(case, dict(zip(named, results, strict=True)), nodes))
    _progress_done()
    click.echo(render(rows, list(named)))
    click.echo(f"\nPeak memory below {memory_floor():.0f} MB is not visible to this runner.")
    if json_file is not None:
        json_file.write_text(json.dumps([_as_data(row) for row in rows], indent=1) + "\n")


def _named(binaries: tuple[str, ...]) -> dict[str, Path]:
    named: dict[str, Path] = {}
    for text in binaries or (f"slugs={ROOT / 'slugs' / 'build' / 'slugs'}",):
        name, equals, path = text.partition("=")
        if not equals:
            name, path = Path(text).name, text
        if name in named:
            raise click.UsageError(f"two binaries are called {name}")
        if not Path(path).is_file():
            raise click.UsageError(f"no binary at {path}; `make slugs` builds slugs/build/slugs")
        named[name] = Path(path)
    return named


def _command(
    named: dict[str, Path],
    name: str,
    case: Case,
    slugsin_only: bool,
    options: tuple[str, ...],
    scratch: Path,
) -> list[str]:
    file = case.file
    if slugsin_only and file.suffix == ".structuredslugs":
        translator = next(iter(named.values()))
        file = scratch / f"{file.stem}.translated.slugsin"
        if not file.exists():
            with file.open("wb") as out:
                subprocess.run([translator, "--translate", case.file], stdout=out, check=True)
    mode = STRATEGY if case.mode == "strategy" else ()
    return [str(named[name]), *mode, *options, str(file)]


def _progress(case: Case, command: Sequence[str]) -> None:
    if sys.stderr.isatty():
        click.echo(f"\r\033[K{case.name} ({case.mode}): {command[0]}", nl=False, err=True)


def _progress_done() -> None:
    if sys.stderr.isatty():
        click.echo("\r\033[K", nl=False, err=True)


def _as_data(row: Row) -> dict[str, object]:
    return {
        "case": row.case.name,
        "mode": row.case.mode,
        "bar_seconds": row.case.bar,
        "nodes": row.nodes,
        "quoted": {"prototype": row.case.prototype, "upstream": row.case.upstream},
        "measured": {name: _summary(summary) for name, summary in row.results.items()},
    }


def _summary(summary: Summary) -> dict[str, object]:
    return asdict(summary)


if __name__ == "__main__":
    main()
