"""The replay page in a real browser, as its readers use it: it opens from disk, plays, tells what
the trace tells, and is legible for everybody."""

import re
from pathlib import Path

import pytest

from report import made_traces
from report.browser import Browser, Keys
from safenav.report.page.html import page_of
from safenav.run.reading import read_run
from safenav.run.run import Run

CELL = 40.0  # side of a region in the page, see front/src/camera.ts
PHONE = {"width": 390, "height": 844}


def view(browser: Browser) -> tuple[float, ...]:
    """x, y, width and height of what the map shows, in regions."""
    box = browser.one(".motion").get_dom_attribute("viewBox") or ""
    return tuple(float(number) / CELL for number in box.split())


def made(lines: made_traces.Lines, folder: Path, source: str = "t.jsonl") -> tuple[Path, Run]:
    """The page of a changed trace, and its run."""
    run, page = read_run(made_traces.write(lines, folder / "t.jsonl")), folder / "page.html"
    page.write_text(page_of(run, source))
    return page, run


def test_a_page_plays_smoothly_to_its_end(browser: Browser, pages: dict[str, Path]) -> None:
    """With reduced motion, robots move in whole ticks."""
    watch = """
        window.seen = [];
        const robot = document.querySelector(`[data-robot="${arguments[0]}"]`);
        const note = () => window.seen.push(robot.getAttribute("transform"));
        note();
        new MutationObserver(note).observe(robot, {attributes: true});
    """
    browser.open(pages["door"])
    assert browser.run('return performance.getEntriesByType("resource").length') == 0
    browser.run(watch, "quad")
    for _ in range(3):
        browser.press("+")
    assert browser.one("select[aria-label='Speed']").get_attribute("value") == "32"
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

    browser.open(pages["door"], motion="reduce")
    browser.run(watch, "digit")
    browser.select("Speed", "2 ticks/s")
    browser.button("Play").click()
    browser.wait(lambda: browser.tick >= 4)
    browser.button("Pause").click()
    assert len(set(browser.run("return window.seen"))) <= browser.tick + 1


def test_the_state_of_a_tick_is_that_of_the_trace(
    browser: Browser, pages: dict[str, Path], replays: dict[str, Run]
) -> None:
    """It is readable in both themes."""
    replay = replays["chain"]
    for tick in (0, 6, replay.last):
        browser.open(pages["chain"], f"#tick={tick}")
        assert browser.tick == tick
        for obstacle in replay.hidden.values():
            status = obstacle.status.at(tick).value
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
    for scheme in ("light", "dark"):
        _texts_are_readable(browser, pages["chain"], scheme)


def test_a_reader_walks_through_a_run(browser: Browser, pages: dict[str, Path]) -> None:
    """By events, keys that work wherever the focus is, and the address of a tick; zooms in; follows
    a robot, its current target and the route there; and finds a name on everything."""
    browser.open(pages["door"])
    browser.one('.event[data-kind="resolved"]').click()
    assert browser.tick == 16
    current = browser.all('.event[aria-current="step"]')
    assert {event.get_attribute("data-tick") for event in current} == {"16"}
    browser.one('.marks button[data-tick="11"]').click()
    assert browser.tick == 11
    assert browser.all('.event[data-kind="goal"]')
    browser.press(Keys.HOME)
    for focus in ("body", "input[type=range]", ".event"):
        browser.run("document.querySelector(arguments[0]).focus()", focus)
        for keys, tick in (
            ((Keys.ARROW_RIGHT,), 1),
            ((Keys.SHIFT, Keys.ARROW_RIGHT), 11),
            ((Keys.ARROW_LEFT,), 10),
            ((Keys.SHIFT, Keys.ARROW_LEFT), 0),
            ((Keys.END,), 46),
            ((Keys.HOME,), 0),
        ):
            browser.press(*keys)
            assert browser.tick == tick, keys
    browser.open(pages["door"], "#tick=12")
    assert browser.tick == 12
    browser.press(Keys.ARROW_RIGHT)
    browser.wait(lambda: browser.run("return location.hash") == "#tick=13")
    for asked, tick in ((30, 30), (4711, 46)):
        browser.run("location.hash = arguments[0]", f"#tick={asked}")
        browser.wait(lambda tick=tick: browser.tick == tick)

    browser.press("f")
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
    browser.press("r")
    for tick in (0, 9):
        browser.run("location.hash = arguments[0]", f"#tick={tick}")
        browser.wait(lambda tick=tick: browser.tick == tick)
        x, y, width, height = view(browser)
        name = browser.run("return document.querySelector('.motion [data-robot]').dataset.robot")
        col, row = browser.centre(name)
        assert (x + width / 2, y + height / 2) == pytest.approx((col + 0.5, row + 0.5), abs=0.1)

    _targets_are_shown(browser, 12)
    _everything_has_a_name_and_shows_its_focus(browser)
    assert not browser.errors()


def _targets_are_shown(browser: Browser, tick: int) -> None:
    """Each robot's current target, and the route there."""
    browser.run("location.hash = arguments[0]", f"#tick={tick}")
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
            assert (x, y) == ((first % 13 + 0.5) * CELL, (first // 13 + 0.5) * CELL), name


def _everything_has_a_name_and_shows_its_focus(browser: Browser) -> None:
    browser.run("location.hash = '#tick=11'")
    browser.wait(lambda: browser.tick == 11)
    told = browser.one(".map").get_attribute("aria-label") or ""
    assert "quad in region 46 [3, 7]" in told and "door@47 requested" in told
    assert browser.one(".story").get_attribute("aria-live") == "polite"
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


def test_a_large_map_fits_every_screen(
    browser: Browser, pages: dict[str, Path], name: str = "crowd"
) -> None:
    """Opened on a phone, and in a window that becomes narrower: nothing needs sideways scrolling.
    The map comes nearer to the region of an event."""
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
    browser.open(pages[name], **PHONE)
    browser.run("arguments[0].click()", browser.one('.event[data-kind="violation"]'))
    assert not browser.all('.event[data-kind="goal"]'), "many goals would hide the other events"
    browser.wait(lambda: browser.all("[data-spoken]"))
    frame = browser.one("[data-spoken]")
    col, line = (float(frame.get_dom_attribute(name) or "nan") / CELL for name in ("x", "y"))
    x, y, width, height = view(browser)
    assert x < col < x + width and y < line < y + height
    assert width < 32, "on a map too large to see it comes nearer"
    browser.run("scrollTo(0, document.documentElement.scrollHeight)")
    top = browser.run('return document.querySelector(".controls").getBoundingClientRect().top')
    assert 0 < top < PHONE["height"] - 80, "playback is always at hand"
    for button in browser.all(".buttons .group button"):
        assert button.rect["width"] >= 36 and button.rect["height"] >= 36


def test_runs_that_failed_or_were_cut_off_are_seen(
    browser: Browser, traces: dict[str, Path], tmp_path: Path
) -> None:
    """One that failed opens at its last moment. Names cannot break out of the page."""
    lines = made_traces.door()
    why = {"explanation": "-", "cause": "no_capable_robot"}
    lines[-1] |= {"outcome": "operator_needed", **why}
    page, replay = made(lines, tmp_path)
    browser.open(page)
    assert browser.tick == replay.last > 0
    browser.open(page, "#tick=3")
    browser.wait(lambda: browser.tick == 3)
    text = traces["door"].read_text()
    cut = tmp_path / "cut.jsonl"
    cut.write_text(text[: len(text) // 2])
    page.write_text(page_of(read_run(cut), "cut.jsonl"))
    browser.open(page)
    assert browser.errors() == []
    assert browser.one(".badge").text == "cut off"
    evil = '</script><script>document.title="broken"</script><!-- <b>&amp;\u2028'
    lines = made_traces.door()
    lines[0]["scenario"]["name"] = evil
    lines[-1]["explanation"] = evil
    browser.open(made(lines, tmp_path, evil)[0], "#tick=46")
    assert browser.errors() == []
    assert browser.driver.title != "broken"
    shown = evil.replace("\u2028", "\\u2028")  # control characters are read as their escapes
    assert browser.run('return document.querySelector("h1").textContent') == shown
    assert shown in browser.run('return document.querySelector(".story").textContent')


def test_the_page_hatches_beliefs_and_tints_sight(browser: Browser, pages: dict[str, Path]) -> None:
    """Those of the robot that the reader chooses."""
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
    browser.press(Keys.ARROW_LEFT)
    browser.press(Keys.ARROW_LEFT)
    chosen = browser.one("select.viewer")
    for option in chosen.find_elements("css selector", "option"):
        option.click()
        many = {"everyone": ["west", "east"], "no robot": []}
        expected = many.get(option.text, [option.text])
        for kind in ("sight", "belief"):
            shown = [e.get_attribute("data-viewer") for e in browser.all(f".shading .{kind}")]
            assert shown == expected
    assert not browser.all(".shading path[class]")


def _luminance(colour: str) -> float:
    parts = [float(part) / 255 for part in colour[colour.index("(") + 1 : -1].split(",")[:3]]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _texts_are_readable(browser: Browser, page: Path, scheme: str) -> None:
    browser.open(page, "#tick=6", scheme=scheme)
    ground = browser.run("return getComputedStyle(document.body).backgroundColor")
    assert (_luminance(ground) > 0.5) == (scheme == "light")
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
    for words, ink, behind in texts:
        light, dark = sorted((_luminance(ink), _luminance(behind)), reverse=True)
        assert (light + 0.05) / (dark + 0.05) >= 4.5, f"{words!r}: {ink} on {behind}"
