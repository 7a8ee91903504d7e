"""The 3D page: small, self-contained, and correct in a real browser."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from report.browser import Browser, Keys
from safenav.cli import group
from safenav.motion.file import Action
from safenav.motion.making import motion_of
from safenav.trace.file import read_trace

SCENARIO = Path(__file__).parents[2] / "scenarios" / "case_study_1.yaml"

PICTURE = """
    const canvas = document.querySelector(".stage3d canvas");
    const copy = document.createElement("canvas");
    copy.width = 64; copy.height = 36;
    const brush = copy.getContext("2d");
    brush.drawImage(canvas, 0, 0, 64, 36);
    return [...brush.getImageData(0, 0, 64, 36).data].join(",");
"""


@pytest.fixture(scope="module")
def trace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("solid") / "door.jsonl"
    _safenav("run", str(SCENARIO), "--trace", str(path), "--no-map")
    return path


@pytest.fixture(scope="module")
def page(trace: Path) -> Path:
    path = trace.with_suffix(".html")
    _safenav("replay", str(trace), "--3d", "-o", str(path))
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    browser = Browser(solid=True)
    yield browser
    browser.driver.quit()


def test_a_case_study_fits_into_400_kilobytes_and_names_no_other_file(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert len(text.encode()) <= 400_000
    assert re.findall(r'(?:src|href)="([^"]*)"', text) == ["data:,"]
    assert "default-src 'none'" in text


def test_the_page_moves_and_its_words_and_picture_show_one_moment(
    trace: Path, page: Path, browser: Browser
) -> None:
    """The words change when the bodies do: at the instant at which the push has ended."""
    browser.open(page, "#t=20.5")
    browser.wait(lambda: browser.all(".stage3d canvas"))
    before = browser.run(PICTURE)
    assert len(set(before.split(","))) > 8, "the scene is blank"
    browser.press(Keys.END)
    browser.wait(lambda: browser.seconds > 200)
    assert browser.run(PICTURE) != before
    browser.press("r")
    assert browser.run('return document.querySelector(".cameras").value') == "0"
    browser.press("f")
    assert browser.run('return document.querySelector(".cameras").value') == "orbit"

    run = read_trace(trace)
    (push,) = [line for line in motion_of(run).lines if isinstance(line, Action)]
    for seconds, status, words in (
        (push.t0 - 0.3, "requested", "quad requests help"),
        (push.t1 - 0.3, "requested", "quad requests help"),
        (push.t1 + 0.3, "resolved", "digit at 47 resolves door@47"),
    ):
        browser.run("location.hash = arguments[0]", f"#t={seconds:.1f}")
        browser.wait(lambda at=seconds: abs(browser.seconds - at) < 0.06)
        door = browser.one('.obstacles [data-obstacle="door@47"]')
        assert door.get_attribute("data-status") == status
        assert words in browser.one(".story").text
        assert ("helps" in browser.one(".robots").text) == (status == "requested")

    def corner() -> int:
        return sum(map(int, browser.run(PICTURE).split(",")[:3]))

    browser.run("location.hash = '#t=20.5'")
    browser.wait(lambda: abs(browser.seconds - 20.5) < 0.06)
    light = corner()
    browser.open(page, "#t=20.5", scheme="dark")
    browser.wait(lambda: browser.all(".stage3d canvas"))
    browser.wait(lambda: corner() < light)
    assert browser.errors() == []


def _safenav(*arguments: str) -> None:
    """A command of safenav in this process; what it refuses is raised."""
    group.main([*arguments], standalone_mode=False)
