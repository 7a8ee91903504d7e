"""The cost of deadlines, batteries and worst cases.

    python benchmarks/deadlines.py [--repeat 3] [--other TREE]

For each shipped scenario: the worst times of its obstacles as ``safenav check`` computes them (bar:
below 2 s), running ahead for its promises, and a whole run with nothing cached: CPU seconds and a
digest of all specifications. ``--other`` runs the same in another tree of safenav (a checkout from
before), with this one's synthesizer: scenarios without deadlines and batteries must have the same
specifications, and take the same time.
"""

import argparse
import json
import os
import subprocess
import sys
import time
from hashlib import sha256
from pathlib import Path
from resource import RUSAGE_CHILDREN
from statistics import median
from tempfile import TemporaryDirectory

from measuring import cpu_seconds

from safenav.report.terminal.table import table
from safenav.runtime.analysis.team_simulation import simulate_team
from safenav.runtime.deadlines.worst import visited, worst_cases
from safenav.runtime.mission import default_synthesizer, first_results
from safenav.scenario.reading.loader import load_scenario
from safenav.synthesis.binary import find_binary

ROOT = Path(__file__).parents[1]
BAR = 2.0
PROGRAM = """\
import sys
sys.meta_path[:] = [f for f in sys.meta_path if "editable" not in str(f.__module__)]
from safenav.cli import main
main()
"""
"""The command of the tree on the path, whichever is installed."""
USES = ("battery:", "within:", "by:")


def main() -> None:
    """Measure and print one line a scenario."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--repeat", type=int, default=3)
    options.add_argument("--other", type=Path, help="another tree of safenav")
    asked = options.parse_args()
    headings = ["scenario", "worst s", "bar", "ahead s", "run CPU s", "specifications"]
    headings += ["other CPU s", "same"] if asked.other else []
    rows = []
    for path in sorted((ROOT / "scenarios").rglob("*.yaml")):
        if {"invalid", "unrealizable"} & {*path.parts}:
            continue
        worst, ahead = _checked(path)
        cost, digest = _run(path, ROOT, asked.repeat)
        row: list[object] = [path.stem, round(worst, 2), "ok" if worst < BAR else "no"]
        row += [round(ahead, 2), round(cost, 3), digest[:12]]
        if asked.other:
            other, theirs = _run(path, asked.other, asked.repeat)
            used = any(word in path.read_text() for word in USES)
            same = "yes" if digest == theirs else "uses them" if used or not theirs else "NO"
            row += [round(other, 3), same]
        rows.append(tuple(row))
    print("\n".join(table(tuple(headings), rows)))


def _checked(path: Path) -> tuple[float, float]:
    """Seconds for the worst cases of a scenario, and for running it ahead."""
    scenario = load_scenario(path)
    synthesizer = default_synthesizer(scenario)
    answers = first_results(scenario, synthesizer).items()
    begun = time.perf_counter()
    found = {name: visited(one.task, one.result.strategy, scenario) for name, one in answers}
    worst_cases(scenario, found)
    half = time.perf_counter()
    simulate_team(scenario, synthesizer)
    return half - begun, time.perf_counter() - half


def _run(path: Path, tree: Path, repeat: int) -> tuple[float, str]:
    """CPU seconds (median) of a run in a tree, and a digest of its specifications; empty if that
    tree cannot read the scenario."""
    costs, digest = [], ""
    for _ in range(repeat):
        with TemporaryDirectory() as folder:
            trace = Path(folder) / "trace.jsonl"
            program = [sys.executable, "-c", PROGRAM, "run", str(path), "--no-map"]
            variables = {"SAFENAV_CACHE": "off", "SAFENAV_SLUGS": str(find_binary().path)}
            environment = {**os.environ, "PYTHONPATH": str(tree), **variables}
            before = cpu_seconds(RUSAGE_CHILDREN)
            command = [*program, "--trace", str(trace)]
            subprocess.run(command, env=environment, cwd=tree, capture_output=True, check=False)
            costs.append(cpu_seconds(RUSAGE_CHILDREN) - before)
            lines = trace.read_text().splitlines() if trace.exists() else []
            told = [json.loads(line).get("spec") for line in lines if '"synthesis"' in line]
            digest = sha256("".join(map(str, told)).encode()).hexdigest() if told else ""
    return median(costs), digest


if __name__ == "__main__":
    main()
