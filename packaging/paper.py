"""The figures of the paper's case studies and its table of times, regenerated.

    python packaging/paper.py build/paper [--repeat 5]

Each case study is run with an empty cache, as its own process, and compared with what its
scenario expects; a second time with beliefs, as the paper has them. Figures: the start, the first
request and the end, as SVG. Table: medians of wall time, as Markdown and CSV.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[1]
MOMENTS = {"start": "0", "request": "request", "end": "last"}
COMMAND = (sys.executable, "-c", "from safenav.cli import main; main()")


@dataclass(frozen=True)
class Times:
    """Medians in seconds; ``syntheses`` is their number, ``longest`` the longest one."""

    study: str
    wall: float
    synthesis: float
    longest: float
    syntheses: int
    ticks: int


def main() -> None:
    """Run everything; the exit status is that of the first run that was not as expected."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--repeat", type=int, default=5)
    chosen = parser.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    names = [f"{number}{beliefs}" for beliefs in ("", "_beliefs") for number in (1, 2, 3)]
    times = [study(name, chosen.folder, chosen.repeat) for name in names]
    headings = tuple(Times.__annotations__)
    rows = [[getattr(found, name) for name in headings] for found in times]
    with (chosen.folder / "times.csv").open("w", newline="") as file:
        csv.writer(file).writerows([headings, *rows])
    lines = ["| case study | `safenav run` | its syntheses | the longest | ticks |"]
    lines += ["|---|---|---|---|---|"]
    lines += [
        f"| {t.study.replace('_', ' with ')} | {t.wall:.2f} s | "
        f"{t.synthesis * 1000:.0f} ms ({t.syntheses}) | {t.longest * 1000:.0f} ms | {t.ticks} |"
        for t in times
    ]
    (chosen.folder / "times.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))
    print(f"figures and tables are in {chosen.folder}")


def study(number: str, folder: Path, repeat: int) -> Times:
    """Run a case study this many times; its figures, without beliefs, are those of the last run."""
    trace = folder / f"case_study_{number}.jsonl"
    walls, outcomes, longest = [], [], []
    for _ in range(max(1, repeat)):
        begun = time.perf_counter()
        safenav("run", ROOT / f"scenarios/case_study_{number}.yaml", "--trace", trace, "--no-map")
        walls.append(time.perf_counter() - begun)
        lines = [json.loads(line) for line in trace.read_text(encoding="utf-8").splitlines()]
        outcomes.append(lines[-1])
        longest.append(max(line["seconds"] for line in lines if line["type"] == "synthesis"))
    safenav("check", trace)
    for name, tick in MOMENTS.items() if number.isdecimal() else ():
        figure = folder / f"case_study_{number}_{name}.svg"
        safenav("replay", trace, "--at", tick, "-o", figure)
    return Times(
        number,
        median(walls),
        median(outcome["synthesis_seconds"] for outcome in outcomes),
        median(longest),
        outcomes[-1]["syntheses"],
        outcomes[-1]["ticks"],
    )


def safenav(*words: object) -> None:
    """Run the command with an empty cache; exit with its output if it fails."""
    with tempfile.TemporaryDirectory() as cache:
        done = subprocess.run(
            [*COMMAND, *map(str, words)],
            env={**os.environ, "SAFENAV_CACHE": cache, "NO_COLOR": "1"},
            capture_output=True,
            text=True,
            check=False,
        )
    if done.returncode:
        print(done.stdout + done.stderr, file=sys.stderr)
        sys.exit(done.returncode)


if __name__ == "__main__":
    main()
