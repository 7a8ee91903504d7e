"""Measures the synthesis for robots that share a floor: over map sides, team sizes, encodings.

    python benchmarks/teams.py                     # the curves of docs/tracking.md
    python benchmarks/teams.py --sides 7,20 --robots 2 --tracking nearby,exact

Each figure is one robot's whole synthesis (specification, slugs, strategy; no cache, not
verified), on an open floor with a wall region in eight, four corners as targets. CPU seconds of
the slugs process. Nothing here is a test: it reports.
"""

from __future__ import annotations

import json
import random
import resource
import time
from pathlib import Path

import click

from safenav.report.terminal.table import table
from safenav.runtime.coordination.strategies import first_answers
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text
from safenav.synthesis.cache import Cache
from safenav.synthesis.slugs import Synthesizer

HEADINGS = ("tracking", "side", "robots", "wall s", "CPU s", "states", "assumes")


def floor(side: int, robots: int, tracking: str, vision: str = "") -> Scenario:
    """A walled floor of ``side`` x ``side`` with that many ground robots."""
    rng = random.Random(side)
    last = side - 2
    corners = [(1, 1), (last, last), (1, last), (last, 1)]
    edge = [(1, c) for c in range(1, last + 1)] + [(last, c) for c in range(1, last + 1)]
    inner = [(r, c) for r in range(2, last) for c in range(2, last)]
    walls = set(rng.sample(inner, k=len(inner) // 8))
    rows = [
        "".join(
            "#" if r in (0, side - 1) or c in (0, side - 1) or (r, c) in walls else "."
            for c in range(side)
        )
        for r in range(side)
    ]
    lines = ["safenav: 1", "name: floor", "map:", "  grid: |", *(f"    {row}" for row in rows)]
    lines.append("robots:")
    starts = corners + [place for place in edge if place not in corners]
    for i in range(robots):
        start, (a, b) = starts[i], (corners[(i + 1) % 4], corners[(i + 2) % 4])
        lines.append(
            f"  r{i}: {{model: digit, start: {list(start)}, heading: east, tracking: {tracking}"
            f"{vision}, objective: {{visit: [{list(a)}, {list(b)}]}}}}"
        )
    return load_scenario_text("\n".join(lines) + "\n")


def measure(side: int, robots: int, tracking: str, seconds: float) -> dict[str, object]:
    """One synthesis: wall and CPU seconds, size, the assumption it rests on."""
    vision = ", vision: 4" if tracking == "belief" else ""
    scenario = floor(side, robots, tracking, vision)
    synthesizer = Synthesizer(seconds=seconds, memory_mb=4096, cache=Cache(None))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begun = time.perf_counter()
    row: dict[str, object] = {"tracking": tracking, "side": side, "robots": robots}
    try:
        answer = first_answers(scenario, synthesizer, names=["r0"])["r0"]
    except Exception as error:  # a limit is a figure, too
        return {**row, "wall": None, "cpu": None, "states": None, "assumes": str(error)[:40]}
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {
        **row,
        "wall": round(time.perf_counter() - begun, 2),
        "cpu": round(after.ru_utime - before.ru_utime, 2),
        "states": answer.result.states,
        "assumes": answer.task.fairness.value if answer.realizable else "unrealizable",
    }


def numbers(text: str) -> list[int]:
    return [int(part) for part in text.split(",")]


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--sides", default="5,7,10,20,30,40,50", show_default=True)
@click.option("--robots", "teams", default="2,4,8", show_default=True)
@click.option("--tracking", "trackings", default="nearby", show_default=True)
@click.option("--seconds", type=float, default=60, show_default=True, help="Limit of each.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write the figures.")
def main(sides: str, teams: str, trackings: str, seconds: float, json_file: Path | None) -> None:
    """Measure one robot's synthesis for every combination."""
    rows = [
        measure(side, robots, tracking, seconds)
        for tracking in trackings.split(",")
        for side in numbers(sides)
        for robots in numbers(teams)
        if robots <= max(2, side - 2)
    ]
    for line in table(HEADINGS, [tuple(row.values()) for row in rows]):
        click.echo(line)
    if json_file is not None:
        json_file.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
