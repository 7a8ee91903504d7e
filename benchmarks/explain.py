"""How long explanations take: the fast path (graph search) and everything.

    python benchmarks/explain.py [--repeat 3]

All shipped unrealizable scenarios, and two rooms without a door from 7 x 13 to 50 x 50. Nothing
is cached. Bars: the fast path under 200 ms, a whole explanation under 5 s. CPU seconds count the
synthesizer's, too.
"""

import argparse
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from measuring import cpu_seconds

from safenav import Scenario, Synthesizer, load_scenario
from safenav.explain.explanation import explain_unrealizable
from safenav.report.terminal.layout import table
from safenav.review.postmortem import explain_team
from safenav.runtime.run.mission import first_results
from safenav.scenario.reading.loader import load_scenario_text
from safenav.synthesis.cache import Cache

ROOT = Path(__file__).parents[1]
SIZES = ((7, 13), (12, 20), (20, 30), (50, 50))


def main() -> None:
    """Measure and print one line a scenario."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--repeat", type=int, default=3)
    repeat = options.parse_args().repeat
    headings = ("scenario", "cause", "core", "repairs", "fast ms", "all s", "CPU s")
    rows = []
    for name, scenario in _scenarios():
        ask = Synthesizer(cache=Cache(None))
        (failed,) = [a for a in first_results(scenario, ask).values() if not a.realizable]
        task = failed.task
        fast = partial(explain_unrealizable, task.robot, task, scenario.map)
        fast_wall = min(_timed(fast)[0] for _ in range(repeat))
        (found,) = explain_team(scenario, ask)
        figures = [_timed(lambda s=scenario, a=ask: [*explain_team(s, a)]) for _ in range(repeat)]
        wall, cpu = min(w for w, _ in figures), min(c for _, c in figures)
        rows.append(
            (
                name,
                found.cause.value,
                len(found.core.members),
                len(found.repairs),
                round(fast_wall * 1000, 1),
                round(wall, 2),
                round(cpu, 2),
            )
        )
    print("\n".join(table(headings, rows)))


def _scenarios() -> Iterator[tuple[str, Scenario]]:
    for file in sorted((ROOT / "scenarios" / "unrealizable").glob("*.yaml")):
        yield file.stem, load_scenario(file, reachable=False)
    for rows, cols in SIZES:
        yield f"rooms {rows} x {cols}", _two_rooms(rows, cols)


def _two_rooms(rows: int, cols: int) -> Scenario:
    half = cols // 2
    inside = "#" + "." * (half - 1) + "#" + "." * (cols - half - 2) + "#"
    grid = ["#" * cols, *[inside] * (rows - 2), "#" * cols]
    start, target = cols + 1, (rows - 1) * cols - 2
    lines = "\n".join(f"    {line}" for line in grid)
    text = f"""
safenav: 1
map:
  grid: |
{lines}
robots:
  digit: {{model: digit, start: {start}, heading: east, objective: {{patrol: [{target}, {start}]}}}}
"""
    return load_scenario_text(text, reachable=False)


def _timed(work: Callable[[], object]) -> tuple[float, float]:
    """Wall and CPU seconds, those of ended children included."""
    wall, cpu = time.perf_counter(), cpu_seconds()
    work()
    return time.perf_counter() - wall, cpu_seconds() - cpu


if __name__ == "__main__":
    main()
