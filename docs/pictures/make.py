"""Makes the pictures of this folder: the case studies, run and replayed.

    python docs/pictures/make.py

Needs safenav with its synthesizer, the extra `pictures`, selenium, and Chromium with its driver.
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

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from report.browser import Browser  # noqa: E402
from safenav.report.html import page_of  # noqa: E402
from safenav.report.picture import svg_of  # noqa: E402
from safenav.report.picture_palette import Palette  # noqa: E402
from safenav.report.replay import EventKind, Replay  # noqa: E402
from safenav.report.replay_reading import read_replay  # noqa: E402


def main() -> None:
    """Run each case study and photograph its start, its first request and its end."""
    browser = Browser()
    try:
        with tempfile.TemporaryDirectory() as folder:
            for number in (1, 2, 3):
                _case_study(browser, number, Path(folder))
    finally:
        browser.driver.quit()


def _case_study(browser: Browser, number: int, folder: Path) -> None:
    name = f"case_study_{number}"
    trace = folder / f"{name}.jsonl"
    program = "from safenav.cli import main; main()"
    scenario = ROOT / "scenarios" / f"{name}.yaml"
    command = [sys.executable, "-c", program, "run", str(scenario), "--trace", str(trace)]
    subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    replay = read_replay(trace)
    page = folder / f"{name}.html"
    page.write_text(page_of(replay, trace.name))
    request = _first_request(replay)
    for moment, tick in (("start", 0), ("request", request), ("end", replay.last)):
        _shoot(browser, page, tick, HERE / f"{name}_{moment}.png")
    if number == 3:
        _shoot(browser, page, request, HERE / "dark.png", scheme="dark")
        _shoot(browser, page, request, HERE / "phone.png", width=390, height=844)
    if number == 1:
        (HERE / f"{name}.svg").write_text(svg_of(replay.scene(request)))


def _first_request(replay: Replay) -> int:
    return next(event.tick for event in replay.events if event.kind is EventKind.REQUEST)


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
    image = Image.open(io.BytesIO(browser.driver.get_screenshot_as_png())).convert("RGB")
    Palette([image]).applied(image).save(path, optimize=True)
    print(f"{path.name}  {path.stat().st_size / 1024:.0f} KiB")


if __name__ == "__main__":
    main()
