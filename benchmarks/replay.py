"""How large the page of a long run is, how fast it opens, and how smoothly it plays.

Measured in headless Chromium, from the page's own navigation and frame timestamps:

    python benchmarks/replay.py [--ticks 1000] [--seconds 5]

Bars: a page of 1,000 ticks and 6 robots under 1 MB, open in under a second, 60 frames per second;
the 3D page of case study 1 (software rendering) under 400 kB, open in 3 s, 30 frames per second.
Needs the packages of the tests (selenium) and Debian's chromium and chromium-driver.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from frames import described, gaps_of

from report.browser import Browser, Keys
from report.runs import own
from runtime.played import play
from safenav import read_trace
from safenav.report.page.html import page_of

LOADED = """
    const entry = performance.getEntriesByType("navigation")[0];
    const paint = performance.getEntriesByName("first-contentful-paint")[0];
    return [entry.loadEventEnd, paint ? paint.startTime : null];
"""
CASE_STUDY = Path(__file__).parents[1] / "scenarios" / "case_study_1.yaml"


def main() -> None:
    """Measure and print one line a figure."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--ticks", type=int, default=1000)
    options.add_argument("--seconds", type=float, default=5.0)
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        lines = play(own("crowd").replace("ticks: 240", f"ticks: {chosen.ticks}")).lines
        trace = Path(folder) / "crowd.jsonl"
        trace.write_text("".join(lines))
        page = Path(folder) / "crowd.html"
        before = time.process_time()
        page.write_text(page_of(read_trace(trace), trace.name))
        spent = time.process_time() - before
        print(f"trace             {trace.stat().st_size / 1e6:8.3f} MB, {len(lines)} lines")
        print(f"page              {page.stat().st_size / 1e6:8.3f} MB, {spent:.2f} s to write")
        _measure(page, chosen.seconds, (4, 16, 64))
        solid = _solid(Path(folder))
        print(f"3D page           {solid.stat().st_size / 1e6:8.3f} MB (case study 1)")
        _measure(solid, chosen.seconds, (1, 4, 16), solid=True)


def _solid(folder: Path) -> Path:
    """The 3D page of case study 1."""
    trace, page = folder / "case.jsonl", folder / "case.html"
    for command in (
        ["run", str(CASE_STUDY), "--no-map", "--trace", str(trace)],
        ["replay", str(trace), "--3d", "-o", str(page)],
    ):
        program = "from safenav.cli import main; main()"
        subprocess.run([sys.executable, "-c", program, *command], check=True, capture_output=True)
    return page


def _measure(page: Path, seconds: float, speeds: tuple[int, ...], solid: bool = False) -> None:
    browser = Browser(solid)
    try:
        opened = []
        for _ in range(5):
            browser.open(page)
            time.sleep(0.3)
            opened.append(browser.run(LOADED))
        loaded = statistics.median(entry[0] for entry in opened)
        painted = [entry[1] for entry in opened if entry[1] is not None]
        paint = f", painted at {statistics.median(painted):.0f} ms" if painted else ""
        print(f"opens in          {loaded:8.0f} ms{paint}")
        for speed in speeds:
            choice = browser.one("select[aria-label=Speed]")
            browser.run("arguments[0].value = arguments[1]", choice, str(speed))
            browser.run("arguments[0].dispatchEvent(new Event('change'))", choice)
            browser.press(Keys.HOME)
            browser.button("Play").click()
            gaps = gaps_of(browser.driver, seconds)
            browser.button("Pause").click()
            late = sum(gap > 25 for gap in gaps) / len(gaps)
            print(f"speed {speed:3}         {described(gaps)}, late {late:.1%}")
    finally:
        browser.driver.quit()


if __name__ == "__main__":
    main()
