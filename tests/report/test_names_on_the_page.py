"""The page of a clinic: names on the map, the story on the timeline, lines that fit."""

from itertools import combinations
from pathlib import Path

import pytest

from once import beside
from report.browser import Browser
from safenav.report.page.html import page_of
from safenav.run.reading import read_run
from tests.warm import safenav

NAMES = 20
"""The clinic has eighteen regions with names, two areas, five robots, joint plans and requests."""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("clinic")
    (folder / "clinic.yaml").write_text(beside(__file__, "scenarios/clinic.yaml"))
    done = safenav("run", "clinic.yaml", "--trace", "clinic.jsonl", "--no-map", cwd=folder)
    assert done.returncode == 0, done.stderr
    page = folder / "clinic.html"
    page.write_text(page_of(read_run(folder / "clinic.jsonl"), "clinic.jsonl"))
    return page


Box = dict[str, float]


def boxes(browser: Browser, selector: str) -> dict[str, Box]:
    """The rectangle on the screen of each text, by its text."""
    script = """
        return Object.fromEntries([...document.querySelectorAll(arguments[0])].map((text) => {
            const {left, top, right, bottom} = text.getBoundingClientRect();
            const size = parseFloat(getComputedStyle(text).fontSize) * text.getScreenCTM().a;
            return [text.dataset.name ?? text.textContent, {left, top, right, bottom, size}];
        }))
    """
    found: dict[str, Box] = browser.run(script, selector)
    return found


def apart(a: Box, b: Box) -> bool:
    across = a["right"] <= b["left"] or b["right"] <= a["left"]
    return across or a["bottom"] <= b["top"] or b["bottom"] <= a["top"]


REGIONS = """
    const run = JSON.parse(document.getElementById("run").textContent);
    const {a, e, f} = document.querySelector("svg.floor").getScreenCTM(), side = 40 * a;
    const named = {...run.areas};
    for (const [region, name] of Object.entries(run.names)) named[name] = [Number(region)];
    return Object.fromEntries(Object.entries(named).map(([name, regions]) => [name,
        regions.map((region) => [e + region % run.cols * side,
                                 f + Math.floor(region / run.cols) * side, side])]));
"""


def inside(box: Box, regions: list[list[float]]) -> bool:
    """Whether the corners of a text are in its own regions (left, top and side on the screen)."""
    corners = [
        (x, y)
        for x in (box["left"] + 1, box["right"] - 1)
        for y in (box["top"] + 3, box["bottom"] - 3)
    ]
    return all(
        any(left <= x <= left + side and top <= y <= top + side for left, top, side in regions)
        for x, y in corners
    )


LOUDEST = """
    const told = {};
    for (const [tick, kind, text] of JSON.parse(document.getElementById("run").textContent).events)
        if (kind !== "goal" && kind !== "synthesis") told[tick] = (told[tick] ?? 0) + text.length;
    return Number(Object.keys(told).reduce((a, b) => (told[a] < told[b] ? b : a)));
"""


def test_all_names_are_legible_and_none_lies_over_another(browser: Browser, page: Path) -> None:
    """Two lines of words cover no region: they covered the last row of tall maps."""
    browser.open(page, width=1440, height=900)
    names = boxes(browser, ".words .names text")
    assert len(names) == NAMES
    regions = browser.run(REGIONS)
    frame = browser.one(".map").rect
    for name, box in names.items():
        assert box["size"] > 8.99, name  # the least size is 9, in coordinates that are rounded
        assert inside(box, regions[name]), f"{name} stands in another region"
        assert box["left"] >= frame["x"] - 1 and box["right"] <= frame["x"] + frame["width"] + 1
    overlaps = [
        (one, other) for (one, a), (other, b) in combinations(names.items(), 2) if not apart(a, b)
    ]
    assert overlaps == []
    layers = browser.run(
        "return [...document.querySelectorAll('.map > svg')].map(s => s.classList[0])"
    )
    assert layers.index("words") < layers.index("motion"), "a robot covers the name of its region"

    browser.open(page, f"#tick={browser.run(LOUDEST)}", width=1440, height=900)
    words = browser.one(".story").rect
    assert words["height"] > 40
    lowest = max(top + side for areas in browser.run(REGIONS).values() for _, top, side in areas)
    assert lowest <= words["y"] + 1
    assert not browser.errors()
