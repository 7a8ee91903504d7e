"""How soon the studio knows what is wrong with an edit, and how smoothly a live run is
shown, on 60 x 80 regions with 12 robots.

    python benchmarks/studio.py [--rows 60] [--cols 80] [--robots 12] [--seconds 10]

Edits in CPU seconds (user and system, this process or the one that judges), so that a busy machine
does not count. Bars: the text judged (syntax, places, what is drawn) within 1 s, the realizability
of one robot within 5 s, also where nothing is in the synthesis cache. Frames in headless Chromium,
from the timestamps that the page gets, while the run plays at the speed it begins with; bar: 30
frames per second. Needs the packages of the tests (selenium) and Debian's chromium and
chromium-driver; `--seconds 0` leaves the browser out.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from resource import RUSAGE_CHILDREN

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from frames import described, gaps_of
from measuring import cpu_seconds
from msgspec.json import encode

from safenav.scenario.reading.loader import load_draft
from safenav.studio.drawing import drawing_of
from safenav.studio.editing import edited
from safenav.studio.process import RunOrder


def scenario(
    rows: int, cols: int, robots: int, models: tuple[str, str] = ("quadcopter", "digit")
) -> str:
    """Halls of 10 x 10 regions with doors between them; robots of two models in turn."""

    def free(row: int, col: int) -> bool:
        inside = 0 < row < rows - 1 and 0 < col < cols - 1
        return (
            inside
            and (row % 10 != 0 or col % 10 in (4, 5))
            and (col % 10 != 0 or row % 10 in (4, 5))
        )

    lines = ["safenav: 1", "map:", "  grid: |"]
    for row in range(rows):
        lines.append("    " + "".join(".#"[not free(row, col)] for col in range(cols)))
    lines.append("robots:")
    for number in range(robots):
        row, col = 3 + 10 * (number % (rows // 10)), 3 + 10 * (number // (rows // 10))
        there = f"[[{row}, {col}], [{row}, {cols - 4 - number % 6}]]"
        robot = f"model: {models[number % 2]}, start: [{row}, {col}], heading: east"
        lines.append(f"  r{number}: {{{robot}, objective: {{visit: {there}}}}}")
    lines += ["obstacles:", "  - {type: door, region: [14, 10]}", "limits: {ticks: 2000}"]
    return "\n".join(lines) + "\n"


def judged(text: str, cache: str) -> tuple[str, float, float]:
    """The first verdict of the process that judges; CPU and wall seconds until then."""
    before = cpu_seconds(RUSAGE_CHILDREN)
    begun = time.perf_counter()
    process = subprocess.Popen(
        [sys.executable, "-m", "safenav.studio.process", "robots"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "SAFENAV_CACHE": cache},
    )
    assert process.stdin is not None and process.stdout is not None
    with process.stdin as orders, process.stdout as answers:
        orders.write(encode(RunOrder(text, "scenario.yaml")).decode() + "\n")
        orders.close()
        answer = json.loads(answers.readline())
        wall = time.perf_counter() - begun
        process.kill()
    process.wait()
    cpu = cpu_seconds(RUSAGE_CHILDREN) - before
    return f"{answer['robot']} {answer['verdict']}", cpu, wall


def shown(text: str, seconds: float) -> str:
    """How the page shows a live run, at 1400 x 900."""
    from report.browser import Browser
    from studio.serving import Served

    browser = Browser()
    try:
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "halls.yaml"
            file.write_text(text)
            with Served("run", file, "--live") as served:
                browser.resize(1400, 900)
                browser.driver.get(served.address)
                browser.wait(lambda: browser.all(".begin button:enabled"))
                browser.one(".begin button").click()
                browser.wait(lambda: browser.all(".clock b") and browser.tick >= 2)
                first = browser.tick
                gaps = gaps_of(browser.driver, seconds)
                ticks = browser.tick - first
                browser.leave()
    finally:
        browser.driver.quit()
    return f"{described(gaps)}, longest {gaps[-1]:.0f} ms, over {ticks} ticks"


def main() -> None:
    """Measure and print one line a figure."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--rows", type=int, default=60)
    options.add_argument("--cols", type=int, default=80)
    options.add_argument("--robots", type=int, default=12)
    options.add_argument("--seconds", type=float, default=10.0)
    chosen = options.parse_args()
    size = (chosen.rows, chosen.cols, chosen.robots)
    print(f"{chosen.rows} x {chosen.cols} regions, {chosen.robots} robots; CPU seconds")
    text = scenario(*size)
    world = load_draft(text, "scenario.yaml").world
    for name, operation in {
        "paint a wall": {"op": "paint", "regions": [5 * chosen.cols + 5], "wall": True},
        "move a robot": {"op": "move_robot", "robot": "r1", "region": 2 * chosen.cols + 5},
    }.items():
        begun = time.process_time()
        text = edited(text, operation, world)
        draft = load_draft(text, "scenario.yaml", reachable=False)
        assert draft.world is not None
        drawing_of(text, draft.world, draft.catalogue)
        told = time.process_time() - begun
        assert load_draft(text, "scenario.yaml").scenario is not None
        whole = time.process_time() - begun
        print(f"{name}: {told:.2f} until it is drawn and judged, {whole:.2f} with all targets")
    for models in (("quadcopter", "digit"), ("digit", "quadcopter")):
        with tempfile.TemporaryDirectory() as cache:
            answer, cpu, wall = judged(scenario(*size, models), cache)
        print(f"{models[0]} {answer}: {cpu:.2f} ({wall:.2f} on the clock)")
    if chosen.seconds > 0:
        print(f"a live run: {shown(scenario(*size), chosen.seconds)}")


if __name__ == "__main__":
    main()
