"""The page in a real browser: it opens from disk, plays, and is usable by everybody."""

import re
from pathlib import Path

import pytest

from report import made_traces
from report.browser import Browser, Keys
from safenav.report.page.html import page_of
from safenav.run.reading import read_run
from safenav.run.run import Run

CELL = 40.0  # side of a region in the page, see front/src/camera.ts


@pytest.mark.parametrize("name", ["door", "chain", "detour", "meeting", "crowd"])
def test_a_page_opens_without_error_or_request(
    browser: Browser, pages: dict[str, Path], name: str
) -> None:
    browser.open(pages[name])
    assert browser.errors() == []
    assert browser.run('return performance.getEntriesByType("resource").length') == 0
    assert browser.tick == 0
    assert float(browser.one("input[type=range]").get_attribute("value") or "nan") == 0


def test_a_page_plays_smoothly_to_its_end(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["door"])
    browser.run("""
        window.seen = [];
        const robot = document.querySelector('[data-robot="quad"]');
        new MutationObserver(() => window.seen.push(robot.getAttribute("transform")))
            .observe(robot, {attributes: true});
    """)
    for _ in range(3):
        browser.press("+")
    assert browser.one(".speed select").get_attribute("value") == "32"
    # Queried within the page two frames later: a slow machine could have played to the end by the
    # time that the browser hears of the next question.
    playing = browser.run("""
        document.querySelector('button[aria-label="Play"]').click();
        return new Promise(done => requestAnimationFrame(() => requestAnimationFrame(
            () => done(!!document.querySelector('button[aria-label="Pause"]')))));
    """)
    assert playing
    browser.wait(lambda: browser.tick == 46)
    browser.wait(lambda: browser.all('button[aria-label="Play"]'))
    places = [re.findall(r"[-\d.]+", seen)[:2] for seen in browser.run("return window.seen")]
    off_centre = [xy for xy in places if any((float(v) - CELL / 2) % CELL for v in xy)]
    assert len(off_centre) > len(places) / 3, "robots leap from region to region"
    assert browser.errors() == []


def test_the_state_of_a_tick_is_that_of_the_trace(
    browser: Browser, pages: dict[str, Path], replays: dict[str, Run]
) -> None:
    replay = replays["chain"]
    for tick in (0, 3, 6, 10, 14, replay.last):
        browser.open(pages["chain"], f"#tick={tick}")
        assert browser.tick == tick
        for obstacle in replay.hidden.values():
            status = replay.statuses[obstacle.name].at(tick).value
            drawn = browser.one(f'.knowledge [data-obstacle="{obstacle.name}"]')
            listed = browser.one(f'.obstacles [data-obstacle="{obstacle.name}"]')
            assert drawn.get_attribute("data-status") == status
            assert listed.get_attribute("data-status") == status
        frames = [item.text for item in browser.all(".stack li b")]
        assert frames == [frame.about() for frame in reversed(replay.stack.at(tick))]
        for track in replay.robots:
            row, col = replay.map.position(track.regions[tick])
            x, y = browser.centre(track.name)
            assert abs(x - col) < 0.3 and abs(y - row) < 0.3


def test_events_can_be_clicked(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["door"])
    browser.one('.event[data-kind="resolved"]').click()
    assert browser.tick == 16
    current = browser.all('.event[aria-current="step"]')
    assert {event.get_attribute("data-tick") for event in current} == {"16"}
    browser.one('.marks button[data-tick="11"]').click()
    assert browser.tick == 11


def test_kinds_of_events_can_be_filtered(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["door"])
    before = len(browser.all(".event"))
    goals = len(browser.all('.event[data-kind="goal"]'))
    filters = {button.text: button for button in browser.all(".filters button")}
    filters["goals"].click()
    assert filters["goals"].get_attribute("aria-pressed") == "false"
    assert goals > 0 and len(browser.all(".event")) == before - goals


@pytest.mark.parametrize("focus", ["body", "input[type=range]", ".event"])
def test_keys_work_wherever_the_focus_is(
    browser: Browser, pages: dict[str, Path], focus: str
) -> None:
    browser.open(pages["door"])
    browser.run("document.querySelector(arguments[0]).focus()", focus)
    browser.press(Keys.ARROW_RIGHT)
    browser.press(Keys.ARROW_RIGHT)
    assert browser.tick == 2
    browser.press(Keys.ARROW_LEFT)
    assert browser.tick == 1
    browser.press(Keys.SHIFT, Keys.ARROW_RIGHT)
    assert browser.tick == 11
    browser.press(Keys.SHIFT, Keys.ARROW_LEFT)
    assert browser.tick == 0
    browser.press(Keys.END)
    assert browser.tick == 46
    browser.press(Keys.ARROW_RIGHT)
    assert browser.tick == 46
    browser.press(Keys.HOME)
    assert browser.tick == 0


def test_the_address_names_the_tick(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["door"], "#tick=12")
    assert browser.tick == 12
    browser.press(Keys.ARROW_RIGHT)
    browser.wait(lambda: browser.run("return location.hash") == "#tick=13")
    browser.run('location.hash = "#tick=30"')
    browser.wait(lambda: browser.tick == 30)
    browser.run('location.hash = "#tick=4711"')
    browser.wait(lambda: browser.tick == 46)


def test_what_the_map_shows_can_be_chosen(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["door"])
    browser.one(".show summary").click()
    shown = {
        "region numbers": ".numbers text",
        "trails": ".trails .trail path",
        "targets": ".knowledge .target",
        "hidden obstacles": ".obstacle.status-hidden",
    }
    for label in browser.all(".choices label"):
        assert browser.all(shown[label.text]), label.text
        label.click()
        assert not browser.all(shown[label.text]), label.text


def test_names_in_a_trace_cannot_break_out(browser: Browser, tmp_path: Path) -> None:
    evil = '</script><script>document.title="broken"</script><!-- <b>&amp;\u2028'
    lines = made_traces.door()
    lines[0]["scenario"]["name"] = evil
    lines[-1]["explanation"] = evil
    page = tmp_path / "evil.html"
    page.write_text(page_of(read_run(made_traces.write(lines, tmp_path / "t.jsonl")), evil))
    browser.open(page, "#tick=46")
    assert browser.errors() == []
    assert browser.driver.title != "broken"
    shown = evil.replace("\u2028", "\\u2028")  # control characters are read as their escapes
    assert browser.run('return document.querySelector("h1").textContent') == shown
    assert shown in browser.run('return document.querySelector(".story").textContent')


def test_a_trace_that_was_cut_off_can_be_seen(
    browser: Browser, traces: dict[str, Path], tmp_path: Path
) -> None:
    text = traces["door"].read_text()
    cut = tmp_path / "cut.jsonl"
    cut.write_text(text[: len(text) // 2])
    page = tmp_path / "cut.html"
    page.write_text(page_of(read_run(cut), "cut.jsonl"))
    browser.open(page)
    assert browser.errors() == []
    assert browser.one(".badge").text == "cut off"


def test_the_page_hatches_beliefs_and_tints_sight(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["meeting"], "#tick=1")
    (belief,) = browser.all(".shading .belief")
    assert belief.get_attribute("data-viewer") == "west"
    assert belief.get_attribute("data-of") == "east"
    (area, _) = belief.find_elements("css selector", "path")
    assert (area.get_attribute("d") or "").count("M") == 3  # rows of the room
    assert [s.get_attribute("data-viewer") for s in browser.all(".shading .sight")] == ["west"]
    for _ in range(2):
        browser.press(Keys.ARROW_RIGHT)
    assert "seen" in (browser.one(".shading .belief").get_attribute("class") or "")


def test_the_shown_view_can_be_chosen(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["meeting"], "#tick=1")
    browser.one(".show summary").click()
    chosen = browser.one(".viewer select")
    for option in chosen.find_elements("css selector", "option"):
        option.click()
        expected = ["west", "east"] if option.text == "everyone" else [option.text]
        for kind in ("sight", "belief"):
            shown = [e.get_attribute("data-viewer") for e in browser.all(f".shading .{kind}")]
            assert shown == expected
    for label in browser.all(".choices label"):
        kind = {"sight": "sight", "beliefs": "belief"}.get(label.text)
        if kind is not None:
            label.click()
            assert not browser.all(f".shading .{kind}")
    assert not browser.all(".shading path[class]")


def test_a_robot_in_transit_is_drawn_between_both_regions(
    browser: Browser, pages: dict[str, Path]
) -> None:
    browser.open(pages["slow"], "#tick=1")
    col, row = browser.centre("slow")
    assert abs(col - (3 - 1 / 3)) < 0.02 and abs(row - 1) < 0.02
    (frame,) = browser.all('.taken[data-robot="slow"]')
    assert frame.get_attribute("width") == "75"
    assert "in transit to 7 [1, 2]" in browser.one(".robots").text
    for _ in range(2):
        browser.press(Keys.ARROW_RIGHT)
    assert not browser.all(".knowledge .taken")
    assert abs(browser.centre("slow")[0] - 2) < 0.02
