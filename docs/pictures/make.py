"""Makes the pictures of this folder: scenarios run and replayed.

    PYTHONPATH=tests python docs/pictures/make.py

Needs the environment of `make install`, and Chromium with its driver.
Look at the pictures before you commit them.
"""

from __future__ import annotations

import io
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from PIL import Image

from report.browser import Browser
from safenav.report.page.html import page_of
from safenav.report.picture.scene import svg_of
from safenav.run.reading import read_run
from safenav.run.run import Run
from safenav.run.values import StoryKind
from studio.serving import Served

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


def main() -> None:
    """Run the scenarios of the pages and photograph what the pages show of them."""
    browser = Browser()
    try:
        with tempfile.TemporaryDirectory() as folder:
            _case_studies(browser, Path(folder))
            _tutorial(browser, Path(folder))
            _solid(Path(folder))
            _team(browser, Path(folder))
        _studio(browser)
    finally:
        browser.driver.quit()


def _case_studies(browser: Browser, folder: Path) -> None:
    """The film of the first one, the request of the first and the third one."""
    replay, _ = _run("case_study_1", folder)
    request = svg_of(replay, _first(replay, StoryKind.REQUEST))
    (HERE / "case_study_1.svg").write_text(request)
    film = ("--width", "760", "--speed", "5", "-o", str(HERE / "case_study_1.gif"))
    _safenav("replay", str(folder / "case_study_1.jsonl"), *film)
    replay, page = _run("case_study_3", folder)
    tick = _first(replay, StoryKind.REQUEST)
    _shoot(browser, page, tick, HERE / "case_study_3_request.png")
    _shoot(browser, page, tick, HERE / "dark.png", scheme="dark")


def _tutorial(browser: Browser, folder: Path) -> None:
    """The scenario of the tutorial, drawn, and its page at the request."""
    text = (HERE.parent / "tutorial.md").read_text(encoding="utf-8")
    scenario, trace = folder / "lab.yaml", folder / "lab.jsonl"
    scenario.write_text(text.split('```yaml title="lab.yaml"\n')[1].split("```")[0])
    _safenav("draw", str(scenario), "-o", str(HERE / "lab.svg"))
    _safenav("run", str(scenario), "--trace", str(trace), "--html", str(folder / "lab.html"))
    request = _first(read_run(trace), StoryKind.REQUEST)
    _shoot(browser, folder / "lab.html", request, HERE / "lab_request.png")


def _solid(folder: Path) -> None:
    """In 3D: Digit at the door while the quadcopter waits, and Digit walking."""
    trace, page = folder / "case_study_1.jsonl", folder / "solid.html"
    _safenav("replay", str(trace), "--3d", "-o", str(page))
    browser = Browser(solid=True)
    browser.open(page, "#tick=15", width=1280, height=720)
    browser.wait(lambda: browser.all(".stage3d canvas"))
    browser.press("r")
    browser.press("r")
    begin, end = browser.run(_FIRST_ACTION)[3:5]
    browser.run(_TO_TIME, begin + 0.6 * (end - begin))
    time.sleep(0.5)
    _keep(browser, HERE / "door_3d.png")
    trace, page = folder / "case_study_3.jsonl", folder / "chain.html"
    _safenav("replay", str(trace), "--3d", "-o", str(page))
    browser.open(page, "", width=1280, height=720)
    browser.wait(lambda: browser.all(".stage3d canvas"))
    browser.press("r")
    browser.press("r")
    browser.run(_TO_TIME, 14.0)
    time.sleep(1.0)
    _keep(browser, HERE / "walking_3d.png")
    browser.driver.quit()


_FIRST_ACTION = """
    return JSON.parse(document.getElementById("motion").textContent).actions[0];
"""
_TO_TIME = """
    const slider = document.querySelector(".timeline input");
    slider.value = String(arguments[0]);
    slider.dispatchEvent(new Event("input", {bubbles: true}));
"""


def _team(browser: Browser, folder: Path) -> None:
    """Beliefs and sight, and two robots that follow a joint plan."""
    replay, page = _run("case_study_3_beliefs", folder)
    tick = _first(replay, StoryKind.RESOLVED)
    _shoot(browser, page, tick, HERE / "beliefs.png")
    replay, _ = _run("corridor_swap", folder)
    aside = svg_of(replay, _first(replay, StoryKind.PLAN) + 6)
    (HERE / "joint_plan.svg").write_text(aside)


def _studio(browser: Browser) -> None:
    """The drawing board, and a run in which a second door was closed."""
    scenario = ROOT / "scenarios" / "case_study_1.yaml"
    metrics = {"width": 1400, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    with Served("studio", scenario, "--no-browser") as served:
        browser.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        light = [{"name": "prefers-color-scheme", "value": "light"}]
        browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": light})
        browser.driver.get(served.address)
        browser.wait(lambda: len(browser.all(".verdict")) == 2, 60)
        _click(browser, '[data-robot="digit"] .body')
        time.sleep(0.5)
        _keep(browser, HERE / "studio_draw.png")
        browser.one("button.run").click()
        browser.wait(lambda: browser.all(".controls.live"), 60)
        browser.select("Speed", "2 ticks/s")
        browser.wait(lambda: browser.tick >= 3, 60)
        browser.select("Close a region with", "door")
        _click(browser, "svg.floor .numbers text:nth-child(24)")
        browser.wait(lambda: browser.all('[data-obstacle="door@44"]') and browser.tick >= 10, 60)
        browser.button("Pause the run").click()
        browser.wait(lambda: browser.one(".badge").text == "paused", 60)
        time.sleep(0.6)
        _keep(browser, HERE / "studio_run.png")


def _click(browser: Browser, selector: str) -> None:
    """Press the mouse in the middle of something drawn."""
    box = browser.one(selector).rect
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    for kind in ("mousePressed", "mouseReleased"):
        event = {"type": kind, "x": x, "y": y, "button": "left", "clickCount": 1}
        browser.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event)


def _run(name: str, folder: Path) -> tuple[Run, Path]:
    """A shipped scenario's replay, and the page of it."""
    trace, page = folder / f"{name}.jsonl", folder / f"{name}.html"
    _safenav("run", str(ROOT / "scenarios" / f"{name}.yaml"), "--trace", str(trace))
    replay = read_run(trace)
    page.write_text(page_of(replay, trace.name))
    return replay, page


def _safenav(*arguments: str) -> None:
    command = [sys.executable, "-c", "from safenav.cli import main; main()", *arguments]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)


def _first(replay: Run, kind: StoryKind) -> int:
    return next(event.tick for event in replay.events if event.kind is kind)


def _shoot(
    browser: Browser,
    page: Path,
    tick: int,
    path: Path,
    width: int = 1280,
    height: int = 800,
    scheme: str = "light",
) -> None:
    browser.open(page, f"#tick={tick}", width, height, scheme)
    time.sleep(0.4)
    _keep(browser, path)


def _keep(browser: Browser, path: Path) -> None:
    """The page as it is now, as a small PNG."""
    image = Image.open(io.BytesIO(browser.driver.get_screenshot_as_png())).convert("RGB")
    image.quantize(256).save(path, optimize=True)
    print(f"{path.name}  {path.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
