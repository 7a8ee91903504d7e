"""Measures whole runs: the case studies with an empty cache.

    python benchmarks/case_studies.py [--repeat 5] [--json FILE]

Wall time of the whole `safenav run` process, verification included; beside it what the trace
says of the syntheses. Nothing here is a test: it reports.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import click

from safenav.report.terminal.layout import table

ROOT = Path(__file__).resolve().parents[1]
SCENARIOS = (
    "hello",
    "case_study_1",
    "case_study_2",
    "case_study_3",
    "case_study_3_beliefs",
    "two_digits",
    "team_of_six",
    "warehouse",
)
UPSTREAM_SECONDS = {"case_study_1": 552, "case_study_2": 671, "case_study_3": 379}
"""CPU seconds of all syntheses of a run with the authors' specifications and upstream SLUGS,
on a machine of 2 cores like ours (docs/performance.md)."""


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--repeat", type=click.IntRange(1), default=5, show_default=True)
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write the figures.")
def main(repeat: int, json_file: Path | None) -> None:
    """Measure the shipped scenarios, interleaved, and print medians."""
    command = shutil.which("safenav", path=f"{Path(sys.executable).parent}:{os.environ['PATH']}")
    if command is None:
        raise click.ClickException("safenav is not installed: run `make install`")
    figures: dict[str, dict[str, list[float]]] = {name: {} for name in SCENARIOS}
    for _ in range(repeat):
        for name in SCENARIOS:
            for key, value in run_once(command, name).items():
                figures[name].setdefault(key, []).append(value)
    medians = {n: {k: median(v) for k, v in f.items()} for n, f in figures.items()}
    for line in table(HEADINGS, [_row(name, f) for name, f in medians.items()]):
        click.echo(line)
    if json_file is not None:
        json_file.write_text(json.dumps(medians, indent=2) + "\n")


HEADINGS = (
    "command",
    "wall s",
    "syntheses",
    "synthesis s",
    "longest s",
    "authors' specs, upstream CPU s",
)


def run_once(command: str, name: str) -> dict[str, float]:
    """One run with an empty cache: seconds of the process, number and seconds of syntheses."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "SAFENAV_CACHE": f"{folder}/cache"}
        trace = Path(folder) / "trace.jsonl"
        scenario = ROOT / "scenarios" / f"{name}.yaml"
        begun = time.perf_counter()
        done = subprocess.run(
            [command, "run", str(scenario), "--json", "--trace", str(trace)],
            check=True,
            capture_output=True,
            env=environment,
        )
        wall = time.perf_counter() - begun
        lines = [json.loads(line) for line in trace.read_text().splitlines()]
    result = json.loads(done.stdout)
    return {
        "wall": wall,
        "syntheses": result["syntheses"],
        "synthesis": result["synthesis_seconds"],
        "longest": max((x["seconds"] for x in lines if x["type"] == "synthesis"), default=0.0),
    }


def _row(name: str, figures: dict[str, float]) -> tuple[object, ...]:
    return (
        f"safenav run {name}",
        round(figures["wall"], 3),
        int(figures["syntheses"]),
        round(figures["synthesis"], 3),
        round(figures["longest"], 3),
        UPSTREAM_SECONDS.get(name),
    )


if __name__ == "__main__":
    main()
