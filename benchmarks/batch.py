"""The overhead of a batch beyond its runs, and what a second process brings.

    python benchmarks/batch.py                 100 generated scenarios, one job against two
    python benchmarks/batch.py --repeat 5 --keep /tmp/suite

Each scenario is a small map with two rooms, a hidden door between them, and a team of two like
in the paper's case study 1: six syntheses, some fifty ticks. The synthesis cache is off. Runs
with one and with several jobs alternate, so that a change in the load of the machine meets
both; ratios are of medians. `overhead` is the wall time that is not a scenario's run (start of
the processes, loading, handing out, results), for each scenario and job.
"""

import argparse
import json
import os
import random
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from resource import RUSAGE_CHILDREN

from measuring import cpu_seconds

from safenav.report.terminal.layout import table

ROWS, COLS = 7, 13

COMMAND = "from safenav.cli import main; main()"


@dataclass(frozen=True)
class Run:
    """``wall`` and ``cpu`` seconds of the whole command, ``inside`` of the runs alone."""

    jobs: int
    cases: int
    wall: float
    cpu: float
    inside: float

    @property
    def overhead(self) -> float:
        """Seconds for each scenario, on each of the jobs' processes."""
        return (self.wall * self.jobs - self.inside) / self.cases


def scenario(seed: int) -> str:
    """Two rooms and a door; the quadcopter patrols both, Digit stays in the first."""
    dice = random.Random(seed)
    wall = dice.randrange(5, COLS - 4)
    door = dice.randrange(2, ROWS - 2)
    grid = [
        "".join(
            "#" if row in (0, ROWS - 1) or col in (0, COLS - 1) or (col == wall and row != door)
            else "."
            for col in range(COLS)
        )
        for row in range(ROWS)
    ]  # fmt: skip
    # The region before the door is not a target: `patrol` could forbid to cross it.
    before = (door, wall - 1)
    west = [(r, c) for r in range(1, ROWS - 1) for c in range(1, wall) if (r, c) != before]
    east = [(r, c) for r in range(1, ROWS - 1) for c in range(wall + 1, COLS - 1)]
    quad, near, start, one, other = (list(place) for place in dice.sample(west, 5))
    far = list(dice.choice(east))
    lines = [
        "safenav: 1",
        f"name: generated {seed}",
        "map:",
        "  grid: |",
        *(f"    {row}" for row in grid),
        "robots:",
        f"  quad: {{model: quadcopter, start: {quad}, objective: {{patrol: [{near}, {far}]}}}}",
        f"  digit: {{model: digit, start: {start}, heading: east, "
        f"objective: {{patrol: [{one}, {other}]}}}}",
        f"obstacles: [{{type: door, region: [{door}, {wall}]}}]",
        "limits: {ticks: 500}",
        f"expect: {{outcome: completed, resolved: [door@{door * COLS + wall}]}}",
    ]
    return "\n".join(lines) + "\n"


def measure(folder: Path, jobs: int) -> Run:
    """One batch over the folder. Raises SystemExit if a scenario is not as expected."""
    command = [sys.executable, "-c", COMMAND, "batch", str(folder), "--jobs", str(jobs), "--json"]
    before = cpu_seconds(RUSAGE_CHILDREN)
    begun = time.perf_counter()
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        env={**os.environ, "SAFENAV_CACHE": "off"},
        check=False,
    )
    wall = time.perf_counter() - begun
    cpu = cpu_seconds(RUSAGE_CHILDREN) - before
    if done.returncode != 0:
        sys.exit(f"the batch failed:\n{done.stdout}{done.stderr}")
    results = json.loads(done.stdout)["results"]
    return Run(jobs, len(results), wall, cpu, sum(result["seconds"] for result in results))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenarios", type=int, default=100)
    parser.add_argument("--jobs", type=int, default=2, help="against one job (default 2)")
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--keep", type=Path, help="write the scenarios there and keep them")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="safenav-batch-") as temporary:
        folder: Path = given.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for seed in range(given.scenarios):
            (folder / f"{seed:04}.yaml").write_text(scenario(seed))
        runs: dict[int, list[Run]] = {1: [], given.jobs: []}
        for number in range(given.repeat):
            for jobs, done in runs.items():
                done.append(measure(folder, jobs))
                print(f"{number + 1}/{given.repeat}, {jobs} jobs: {done[-1].wall:.2f} s")
    headings = ("jobs", "wall s", "CPU s", "s a run", "overhead ms")
    rows = []
    for jobs, done in runs.items():
        wall, cpu, inside, over = (
            statistics.median(values)
            for values in zip(*((r.wall, r.cpu, r.inside, r.overhead) for r in done), strict=True)
        )
        rows.append((jobs, round(wall, 2), round(cpu, 2), round(inside / given.scenarios, 3),
                     round(over * 1000, 1)))  # fmt: skip
    print(f"\n{given.scenarios} scenarios, median of {given.repeat}")
    print("\n".join(table(headings, rows)))
    print(f"\n{rows[0][1] / rows[-1][1]:.2f} times faster with {given.jobs} jobs")


if __name__ == "__main__":
    main()
