"""Measures teams that share a floor: one robot's synthesis over map sides, and whole runs.

    python benchmarks/teams.py                     # the curves of docs/performance.md
    python benchmarks/teams.py --sides 7,20 --robots 2 --tracking nearby,exact
    python benchmarks/teams.py --bars              # bars of teams and measured figures

Each figure of the curves is one robot's whole synthesis (specification, slugs, strategy; no cache,
not verified), on an open floor with a wall region in eight, four corners as targets. CPU seconds
of the slugs process. Nothing here is a test: it reports.
"""

import json
import random
import resource
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median, quantiles

import click
import missions
from measuring import cpu_seconds

from safenav.report.terminal.layout import table
from safenav.runtime.run.mission import first_results
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
    before = cpu_seconds(resource.RUSAGE_CHILDREN)
    begun = time.perf_counter()
    row: dict[str, object] = {"tracking": tracking, "side": side, "robots": robots}
    try:
        answer = first_results(scenario, synthesizer, names=["r0"])["r0"]
    except Exception as error:  # a limit is a figure, too
        return {**row, "wall": None, "cpu": None, "states": None, "assumes": str(error)[:40]}
    spent = cpu_seconds(resource.RUSAGE_CHILDREN) - before
    return {
        **row,
        "wall": round(time.perf_counter() - begun, 2),
        "cpu": round(spent, 2),
        "states": answer.result.states,
        "assumes": answer.task.fairness.value if answer.realizable else "unrealizable",
    }


BAR_HEADINGS = ("what", "bar", "measured", "met", "wall s", "CPU s", "syntheses")
SHIPPED = {"two_digits": 14, "team_of_six": 40}
"""Most syntheses of a whole run."""
CROWDS = 10


def bars() -> Iterator[tuple[object, ...]]:
    """One row for each bar, as soon as it is measured."""
    for side, most in ((50, 1.0), (100, 10.0)):
        row = measure(side, 4, "nearby", 120)
        what = f"a synthesis on {side} x {side} among four, CPU s"
        yield _judged(what, row["cpu"], most, row["wall"], row["cpu"], 1)
    for name, count in SHIPPED.items():
        yield _of_run(f"{name}, syntheses", missions.run(name), count, "syntheses")
    for robots, seconds in ((4, 2.0), (12, 10.0)):
        what = f"{robots} quadcopters to mirrored places, s"
        yield _of_run(what, missions.mirrored(robots), seconds)
    crowds = [missions.crowd(seed) for seed in range(CROWDS)]
    slowest = max(crowds, key=lambda run: run.wall)
    yield _of_run(f"the slowest of {CROWDS} crowds in rooms, s", slowest, 30.0)
    searches: list[float] = []
    for robots, flyers, doors, seconds in ((20, 2, 5, 90.0), (50, 0, 0, 300.0)):
        run = missions.large(robots, flyers, doors)
        if run is not None:
            searches += run.searches
            what = f"random-32-32-10, {robots} robots, {flyers} flyers, {doors} doors, s"
            yield _of_run(what, run, seconds)
    if len(searches) > 1:
        yield _judged("there, a plan's median, s", round(median(searches), 3), 0.05)
        yield _judged("there, a plan's 99th percentile, s", round(_high(searches), 3), 1.0)


def _high(values: list[float]) -> float:
    return quantiles(values, n=100, method="inclusive")[-1]


def _of_run(what: str, run: missions.Run, most: float, figure: str = "wall") -> tuple[object, ...]:
    if run.outcome != "completed":
        what, most = f"{what}: {run.outcome}", -1.0
    wall, cpu = round(run.wall, 2), round(run.cpu, 2)
    return _judged(
        what, run.syntheses if figure == "syntheses" else wall, most, wall, cpu, run.syntheses
    )


def _judged(what: str, figure: object, most: float, *more: object) -> tuple[object, ...]:
    met = isinstance(figure, int | float) and figure <= most
    return (what, most, figure, "yes" if met else "no", *more, *("",) * (3 - len(more)))


def numbers(text: str) -> list[int]:
    return [int(part) for part in text.split(",")]


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--sides", default="5,7,10,20,30,40,50", show_default=True)
@click.option("--robots", "teams", default="2,4,8", show_default=True)
@click.option("--tracking", "trackings", default="nearby", show_default=True)
@click.option("--seconds", type=float, default=60, show_default=True, help="Limit of each.")
@click.option("--bars", "asked", is_flag=True, help="Measure the bars of teams instead.")
@click.option("--json", "json_file", type=click.Path(path_type=Path), help="Write the figures.")
def main(
    sides: str, teams: str, trackings: str, seconds: float, asked: bool, json_file: Path | None
) -> None:
    """Measure one robot's synthesis for every combination."""
    if asked:
        judged = list(bars())
        for line in table(BAR_HEADINGS, judged):
            click.echo(line)
        if json_file is not None:
            written = [dict(zip(BAR_HEADINGS, row, strict=True)) for row in judged]
            json_file.write_text(json.dumps(written, indent=2) + "\n")
        return
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
