"""Looking around on the page: zoom, follow, go to an event, lanes."""

from pathlib import Path

import pytest

from report import made_traces
from report.browser import Browser
from safenav.report.page.html import page_of
from safenav.run.reading import read_run


def view(browser: Browser) -> tuple[float, ...]:
    """x, y, width and height of what the map shows, in regions."""
    box = browser.one(".motion").get_dom_attribute("viewBox") or ""
    return tuple(float(number) / 40 for number in box.split())


def test_keys_and_buttons_zoom_and_the_whole_map_comes_back(
    browser: Browser, pages: dict[str, Path]
) -> None:
    browser.open(pages["door"])
    whole = view(browser)
    assert whole[0] <= 0.5 and whole[1] <= 0.5 and whole[0] + whole[2] >= 12.5
    browser.press("i")
    assert view(browser)[2] == pytest.approx(whole[2] / 1.5, rel=0.01)
    before = view(browser)
    browser.press("d")
    assert view(browser)[0] > before[0]
    browser.button("Zoom in").click()
    assert view(browser)[2] == pytest.approx(whole[2] / 2.25, rel=0.01)
    browser.press("f")
    assert view(browser) == pytest.approx(whole, abs=0.01)
    assert not browser.errors()


def test_a_followed_robot_stays_in_the_middle(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["door"])
    browser.press("r")
    for tick in (0, 9):
        browser.run("location.hash = arguments[0]", f"#tick={tick}")
        browser.wait(lambda tick=tick: browser.tick == tick)
        x, y, width, height = view(browser)
        name = browser.run("return document.querySelector('.motion [data-robot]').dataset.robot")
        col, row = browser.centre(name)
        assert (x + width / 2, y + height / 2) == pytest.approx((col + 0.5, row + 0.5), abs=0.1)


def test_a_click_on_an_event_goes_to_its_region(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["crowd"], width=390, height=844)
    row = browser.one('.event[data-kind="violation"]')
    browser.run("arguments[0].click()", row)
    browser.wait(lambda: browser.all(".pointed"))
    ring = browser.one(".pointed")
    col, line = (float(ring.get_dom_attribute(name) or "nan") / 40 for name in ("cx", "cy"))
    x, y, width, height = view(browser)
    assert x < col < x + width and y < line < y + height
    assert width < 32, "on a map too large to see it comes nearer"


def test_a_run_that_failed_opens_at_its_last_moment(browser: Browser, tmp_path: Path) -> None:
    lines = made_traces.door()
    why = {"explanation": "-", "cause": "no_capable_robot"}
    lines[-1] |= {"outcome": "operator_needed", **why}
    replay = read_run(made_traces.write(lines, tmp_path / "failed.jsonl"))
    page = tmp_path / "failed.html"
    page.write_text(page_of(replay, "failed.jsonl"))
    browser.open(page)
    assert browser.tick == replay.last > 0
    browser.open(page, "#tick=3")
    browser.wait(lambda: browser.tick == 3)


@pytest.mark.parametrize("tick", [2, 12, 20])
def test_each_robot_shows_its_current_target_and_the_way_there(
    browser: Browser, pages: dict[str, Path], tick: int
) -> None:
    browser.open(pages["door"], f"#tick={tick}")
    browser.wait(lambda: browser.tick == tick)
    current = browser.run(
        "return Object.fromEntries([...document.querySelectorAll('.aim.current')]"
        ".map(ring => [ring.parentElement.dataset.of, +ring.parentElement.dataset.target]))"
    )
    ways = browser.run(
        "return Object.fromEntries([...document.querySelectorAll('[data-intention]')]"
        ".map(way => [way.dataset.intention, way.getAttribute('d').split(/[ML]/).pop()]))"
    )
    robots = browser.run("return JSON.parse(document.getElementById('run').textContent).robots")
    for robot in robots:
        name, path = robot["name"], robot["path"]
        until = min((row[0] for row in robot["tasks"] if row[0] > tick), default=len(path) - 1)
        met = (each[2] for each in robot["progress"] if tick < each[0] <= until and each[2] >= 0)
        first = next(met, path[until])  # before it gets another task
        assert current[name] == first, name
        if path[tick] != first:
            x, y = map(float, ways[name].split())
            assert (x, y) == ((first % 13 + 0.5) * 40, (first // 13 + 0.5) * 40), name
