"""How often a promise that ends late was said to be lost before, and whether that was true.

    python benchmarks/promises.py [--runs 1000] [--from 0]

Random missions with tight limits (``tests/runtime/deadlines/timed.py``), each judged by the audit.
A promise that is lost must not be kept; a late one is to be lost before (bar: nine of ten). One
that is lost with the end of its due tick is said one tick before: the table has those apart.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from runtime.deadlines.timed import busy_scenario, timed_scenario
from runtime.played import Line, Run
from safenav.errors import InputError
from safenav.report.terminal.table import table
from safenav.runtime.mission import Mission
from safenav.scenario.model import Scenario
from safenav.scenario.reading.loader import load_scenario_text


def main() -> None:
    """Run the missions and print what became of their promises, one line a kind."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--runs", type=int, default=1000)
    options.add_argument("--from", type=int, default=0, dest="first", help="first seed")
    asked = options.parse_args()
    found, runs, seed = Counter[tuple[str, str]](), 0, asked.first
    while runs < asked.runs:
        text = (timed_scenario, busy_scenario)[seed % 2](seed)
        seed += 1
        try:
            scenario = load_scenario_text(text)
        except InputError:
            continue
        runs += 1
        found.update(_promises(_run(scenario, f"seed {seed - 1}")))
    columns = ("kept", "lost, kept", "late", "lost before", "in its last tick", "not said")
    rows = []
    for kind in ("obstacle", "round", "mission"):
        counts = [found[kind, column] for column in columns]
        said, late = counts[3] + counts[4], counts[2]
        bar = "ok" if not counts[1] and said >= 0.9 * late else "no"
        rows.append((kind, *counts, bar))
    print("\n".join(table(("promise of", *columns, "bar"), rows)))


def _run(scenario: Scenario, name: str) -> list[Line]:
    run = Run()
    Mission(scenario, listeners=[run]).run()
    for finding in run.findings.splitlines():
        print(f"{name}: {finding}", file=sys.stderr)
    return run.records


def _promises(lines: list[Line]) -> list[tuple[str, str]]:
    """Kind and end of each promise of a run."""
    lost: dict[tuple[str, int], int] = {}
    found = []
    for line in lines:
        if line["type"] != "deadline":
            continue
        promise = line["of"], line["due"]
        kind = "obstacle" if "@" in line["of"] else "round"
        kind = "mission" if line["of"] == "mission" else kind
        if line["verdict"] == "lost":
            lost[promise] = line["tick"]
        elif line["verdict"] == "kept":
            found.append((kind, "kept" if promise not in lost else "lost, kept"))
        elif line["verdict"] == "late":
            told = lost.get(promise)
            early = "lost before" if told is not None and told < line["due"] else "in its last tick"
            found += [(kind, "late"), (kind, "not said" if told is None else early)]
    return found


if __name__ == "__main__":
    main()
