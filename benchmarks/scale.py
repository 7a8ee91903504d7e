"""Measures whole runs of large teams, full floors and large maps beside their bars.

    python benchmarks/scale.py [--only 200] [--json FILE]

CPU seconds and peak memory of the whole `safenav run` process, with its synthesizers and an empty
cache. Nothing here is a test: it reports.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import click
import yaml
from floors import benchmark, maps_folder, mission

from safenav.report.terminal.layout import table

HEADINGS = ("what", "bar, CPU s", "CPU s", "MB", "met", "outcome", "ticks")
TEAMS = {20: 0.8, 50: 1.5, 100: 3.0, 200: 8.0, 300: None}
CITY = {1: 4.0, 5: 10.0, 20: 30.0}
SCENARIOS = Path(__file__).resolve().parents[1] / "scenarios"
Case = tuple[str, float | None, Callable[[], Any]]
"""The name of a case, its bar, and its scenario: a file, or data."""


def cases() -> Iterator[Case]:
    folder = maps_folder()
    if folder is None:
        click.echo("without the maps of the MovingAI benchmarks: see README.md", err=True)
    else:
        for robots, bar in TEAMS.items():
            yield f"random-32-32-10, {robots} robots", bar, partial(benchmark, robots, 0, 0, 0)
        for robots, bar in CITY.items():
            yield f"Paris_1_256, {robots} robots", bar, partial(city, folder, robots)
    yield "8 robots on 13 regions (crowd_hidden 203)", 2.0, partial(mission, "crowd_hidden", 203)
    for number in (1, 2, 3):
        yield f"case study {number}", 0.2, partial(SCENARIOS.joinpath, f"case_study_{number}.yaml")


def city(folder: Path, robots: int) -> dict[str, Any]:
    """Robots on a city of 256 x 256 regions, half of them with headings, a round of two goals
    each."""
    rows = (folder / "Paris_1_256.map").read_text().split("map\n", 1)[1].split()
    free = {(r, c) for r, row in enumerate(rows) for c, mark in enumerate(row) if mark == "."}
    start = max(free)
    reached, found = {start}, [start]
    while found:
        r, c = found.pop()
        beside = ({(r + 1, c), (r - 1, c), (r, c + 1), (r, c - 1)} & free) - reached
        reached |= beside
        found += beside
    square = [-1, 0, 1]
    wide = [p for p in reached if {(p[0] + r, p[1] + c) for r in square for c in square} <= reached]
    drawn = map(list, Random(1).sample(sorted(wide), 3 * robots))
    kinds = {"cart": "free", "car": "heading"}
    team: dict[str, Any] = {}
    for k, (place, one, other) in enumerate(zip(drawn, drawn, drawn, strict=True)):
        team[f"r{k}"] = {"start": place, "objective": {"visit": [one, other]}}
        team[f"r{k}"] |= {"model": "car", "heading": "east"} if k % 2 else {"model": "cart"}
    return {
        "safenav": 1,
        "name": f"Paris_1_256 {robots}",
        "map": {"movingai": str(folder / "Paris_1_256.map")},
        "catalogue": {
            "robots": {
                name: {"mobility": mobility, "layer": "ground", "capabilities": []}
                for name, mobility in kinds.items()
            }
        },
        "robots": team,
        "until": {"rounds": 1},
        "limits": {"ticks": 5000},
    }


def measured(command: str, case: Case) -> tuple[object, ...]:
    """The row of one run."""
    what, bar, scenario = case[0], case[1], case[2]()
    with tempfile.TemporaryDirectory() as folder:
        path = scenario
        if not isinstance(scenario, Path):
            path = Path(folder) / "scenario.yaml"
            path.write_text(yaml.safe_dump(scenario, sort_keys=False))
        environment = {**os.environ, "SAFENAV_CACHE": f"{folder}/cache"}
        with (Path(folder) / "result.json").open("w+") as out:
            arguments = [command, "run", str(path), "--json"]
            process = subprocess.Popen(
                arguments, stdout=out, stderr=subprocess.DEVNULL, env=environment
            )
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            out.seek(0)
            text = out.read()
    cpu = round(usage.ru_utime + usage.ru_stime, 2)
    result = json.loads(text) if text else {"outcome": "failed", "ticks": None}
    met = result["outcome"] == "completed" and (bar is None or cpu <= bar)
    size = usage.ru_maxrss // 1024
    return what, bar, cpu, size, "yes" if met else "no", result["outcome"], result["ticks"]


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--only", default="", help="Only what contains this.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write the figures.")
def main(only: str, json_file: Path | None) -> None:
    """Run each case once and print what it cost."""
    command = shutil.which("safenav", path=f"{Path(sys.executable).parent}:{os.environ['PATH']}")
    if command is None:
        raise click.ClickException("safenav is not installed: run `make install`")
    rows = [measured(command, case) for case in cases() if only in case[0]]
    for line in table(HEADINGS, rows):
        click.echo(line)
    if json_file is not None:
        written = [dict(zip(HEADINGS, row, strict=True)) for row in rows]
        json_file.write_text(json.dumps(written, indent=2) + "\n")


if __name__ == "__main__":
    main()
