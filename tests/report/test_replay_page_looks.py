"""The page as people see it: contrast, themes, narrow screens, names for those who hear it."""

from itertools import pairwise
from pathlib import Path

import pytest

from report import made_traces
from report.browser import Browser, Keys
from safenav.report.page.html import page_of
from safenav.report.replay.reading import read_replay
from tests.warm import safenav

PHONE = {"width": 390, "height": 844}


def _luminance(colour: str) -> float:
    parts = [float(part) / 255 for part in colour[colour.index("(") + 1 : -1].split(",")[:3]]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_texts_are_readable_in_both_themes(
    browser: Browser, pages: dict[str, Path], scheme: str
) -> None:
    browser.open(pages["chain"], "#tick=6", scheme=scheme)
    page = _luminance(browser.run("return getComputedStyle(document.body).backgroundColor"))
    assert (page > 0.5) == (scheme == "light")
    script = """
        return [...document.querySelectorAll("p, b, li, button, span, h1, h2, label, summary")]
            .filter(e => [...e.childNodes].some(n => n.nodeType === 3 && n.data.trim()))
            .filter(e => e.getClientRects().length && !e.closest(".unseen"))
            .map(e => {
                let behind = e;
                const ground = () => getComputedStyle(behind).backgroundColor;
                while (ground() === "rgba(0, 0, 0, 0)") behind = behind.parentElement;
                return [e.textContent.slice(0, 40), getComputedStyle(e).color, ground()];
            });
    """
    texts = browser.run(script)
    assert len(texts) > 40
    for words, ink, ground in texts:
        light, dark = sorted((_luminance(ink), _luminance(ground)), reverse=True)
        assert (light + 0.05) / (dark + 0.05) >= 4.5, f"{words!r}: {ink} on {ground}"


def test_the_theme_can_be_chosen(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["door"], scheme="light")
    background = "return getComputedStyle(document.body).backgroundColor"
    light = browser.run(background)
    browser.press("t")
    assert browser.all('button[aria-label="Theme: light"]')
    assert browser.run(background) == light
    browser.button("Theme: light").click()
    assert browser.run(background) != light
    browser.press("t")
    assert browser.all('button[aria-label="Theme: auto"]')


@pytest.mark.parametrize("name", ["chain", "crowd"])
def test_no_width_needs_sideways_scrolling(
    browser: Browser, pages: dict[str, Path], name: str
) -> None:
    """Opened on a phone, and in a window that becomes narrower."""
    for width in (390, 1920, 1280, 900, 700, 320):
        if width in (390, 1920):
            browser.open(pages[name], "#tick=6", width=width, height=800)
        else:
            browser.resize(width, 800)
            browser.wait(lambda width=width: browser.run("return innerWidth") == width)
        assert browser.run("return document.documentElement.scrollWidth") <= width
        for selector in (".map", ".controls", "aside", "header"):
            box = browser.one(selector).rect
            assert box["x"] >= 0 and box["x"] + box["width"] <= width + 0.5, selector
        assert browser.one(".map").rect["height"] > 80


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (1024, 640), (1920, 1080)])
def test_nothing_overlaps_on_a_desktop(
    browser: Browser, pages: dict[str, Path], width: int, height: int
) -> None:
    browser.open(pages["chain"], "#tick=6", width=width, height=height)
    boxes = {s: browser.one(s).rect for s in ("header", ".map", ".controls", "aside")}
    for name, a in boxes.items():
        assert a["y"] + a["height"] <= height + 0.5, f"{name} is cut off"
        for other, b in boxes.items():
            apart = (
                a["x"] + a["width"] <= b["x"] + 0.5
                or b["x"] + b["width"] <= a["x"] + 0.5
                or a["y"] + a["height"] <= b["y"] + 0.5
                or b["y"] + b["height"] <= a["y"] + 0.5
            )
            assert name == other or apart, f"{name} overlaps {other}"


@pytest.mark.parametrize("name", ["chain", "crowd"])
def test_a_low_window_shows_map_state_and_events_at_once(
    browser: Browser, pages: dict[str, Path], name: str
) -> None:
    """On a laptop the events began at the lower edge, and a long story lay over the choices."""
    browser.open(pages[name], "#tick=6", width=1280, height=640)
    boxes = {s: browser.one(s).rect for s in (".map", ".strip", ".controls")}
    over = browser.all("main.walled")  # the strip stands on the outer wall
    for (upper, a), (lower, b) in pairwise(
        [pair for pair in boxes.items() if not (over and pair[0] == ".strip")]
    ):
        assert a["y"] + a["height"] <= b["y"] + 0.5, f"{upper} lies over {lower}"
    rows = browser.one(".events .list").rect
    assert rows["y"] < 0.85 * 640 and rows["height"] > 0.15 * 640
    for panel in (".robots", ".stack", ".obstacles"):
        if not browser.all(panel):
            continue  # it would be empty
        box = browser.one(panel).rect
        above, beside = box["y"] + box["height"] <= rows["y"], box["x"] + box["width"] <= rows["x"]
        assert box["height"] > 24 and (above or beside), panel


@pytest.mark.parametrize("number", [1, 2, 3])
def test_most_of_the_window_is_the_map(browser: Browser, tmp_path: Path, number: int) -> None:
    """The free floor took a fifth of the window."""
    scenario = Path(__file__).parents[2] / "scenarios" / f"case_study_{number}.yaml"
    assert safenav("run", str(scenario), "--trace", "run.jsonl", cwd=tmp_path).returncode == 0
    assert safenav("replay", "run.jsonl", cwd=tmp_path).returncode == 0
    browser.open(tmp_path / "run.html", width=1440, height=900)
    share = browser.run("""
        const run = JSON.parse(document.getElementById("run").textContent);
        const side = 40 * document.querySelector("svg.floor").getScreenCTM().a;
        const free = [...run.grid.join("")].filter((cell) => cell !== "#").length;
        return free * side * side / (innerWidth * innerHeight);
    """)
    assert share >= 0.45


def test_marks_of_the_timeline_do_not_overlap(browser: Browser, pages: dict[str, Path]) -> None:
    for width in (390, 1280):
        browser.open(pages["crowd"], width=width, height=800)
        rows: dict[float, list[float]] = {}
        for mark in browser.all(".marks button"):
            rows.setdefault(mark.rect["y"], []).append(mark.rect["x"])
        assert len(max(rows.values(), key=len)) > 2
        for row in rows.values():
            assert all(b - a >= 16 for a, b in pairwise(sorted(row)))
        assert all(b - a >= 16 for a, b in pairwise(sorted(rows)))


def test_an_input_has_its_own_mark_beside_a_discovery(browser: Browser, tmp_path: Path) -> None:
    """An alarm one tick after a discovery was only named by the mark of the discovery."""
    lines = made_traces.door()
    at = next(n for n, line in enumerate(lines) if line["type"] == "push")
    lines.insert(at, {"type": "inputs", "tick": lines[at]["tick"], "values": {"alarm": True}})
    page = tmp_path / "alarm.html"
    trace = made_traces.write(lines, tmp_path / "alarm.jsonl")
    page.write_text(page_of(read_replay(trace), trace.name), encoding="utf-8")
    browser.open(page, width=500)
    (mark,) = browser.all('.marks button[data-kind="inputs"]')
    assert mark.get_attribute("title") == "tick 11: inputs: alarm on"


def test_paper_gets_all_events_and_no_controls(browser: Browser, pages: dict[str, Path]) -> None:
    """The list of events was cut, and playback lay over it."""
    browser.open(pages["door"], width=794, height=1123)
    print_ = {"media": "print", "features": []}
    browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", print_)
    try:
        shown = browser.run(
            "return [...document.querySelectorAll('.buttons *, .tools *, .filters *, .choices *')]"
            ".filter((each) => each.checkVisibility()).length"
        )
        cut = browser.run(
            "const list = document.querySelector('.events .list');"
            "return [list.scrollHeight - list.clientHeight,"
            " getComputedStyle(document.querySelector('.controls')).position]"
        )
    finally:
        browser.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
    assert (shown, cut) == (0, [0, "static"])


def test_on_a_phone_playback_is_always_at_hand(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["chain"], **PHONE)
    browser.run("scrollTo(0, document.documentElement.scrollHeight)")
    top = browser.run('return document.querySelector(".controls").getBoundingClientRect().top')
    assert 0 < top < PHONE["height"] - 80
    for button in browser.all(".buttons .group button"):
        assert button.rect["width"] >= 36 and button.rect["height"] >= 36


def test_every_control_has_a_name_and_shows_its_focus(
    browser: Browser, pages: dict[str, Path]
) -> None:
    browser.open(pages["door"])
    for element in browser.all("button:not([aria-hidden]), select, input, summary"):
        if element.is_displayed():
            assert element.accessible_name, element.get_attribute("outerHTML")
    focused = set()
    for _ in range(14):
        browser.press(Keys.TAB)
        which = "return [...document.querySelectorAll('*')].indexOf(document.activeElement)"
        focused.add(browser.run(which))
        outline = "return getComputedStyle(document.activeElement).outlineStyle"
        assert browser.run(outline) != "none"
    assert len(focused) == 14


def test_the_map_has_a_description_for_screen_readers(
    browser: Browser, pages: dict[str, Path]
) -> None:
    browser.open(pages["door"], "#tick=11")
    told = browser.one(".map").get_attribute("aria-label")
    assert told is not None
    assert "quad in region 46 [3, 7]" in told and "door@47 requested" in told
    assert browser.one(".story").get_attribute("aria-live") == "polite"


def test_reduced_motion_moves_robots_in_whole_ticks(
    browser: Browser, pages: dict[str, Path]
) -> None:
    browser.open(pages["door"], motion="reduce")
    browser.run("""
        window.places = new Set();
        const robot = document.querySelector('[data-robot="digit"]');
        const note = () => window.places.add(robot.getAttribute("transform"));
        note();
        new MutationObserver(note).observe(robot, {attributes: true});
    """)
    browser.slow()
    browser.button("Play").click()
    browser.wait(lambda: browser.tick >= 4)
    browser.button("Pause").click()
    assert len(browser.run("return [...window.places]")) <= browser.tick + 1
