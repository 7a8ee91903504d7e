"""The replay page in a real browser, as its readers use it: it opens from disk, plays, shows what
the trace records, and is legible to every reader; also in three dimensions."""

import re
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path

import pytest

from report.browser import Browser, Keys
from report.runs import changed, data_of, page_of, paged, run_of, trace_of

CELL = 40.0  # side of a region in the page, see front/src/camera.ts
PHONE = {"width": 390, "height": 844}
DESK = {"width": 1440, "height": 900}


def view(browser: Browser) -> tuple[float, ...]:
    """x, y, width and height of what the map shows, in regions."""
    box = browser.one(".motion").get_dom_attribute("viewBox") or ""
    return tuple(float(number) / CELL for number in box.split())


def test_a_page_plays_smoothly_to_its_end(browser: Browser) -> None:
    watch = """
        window.seen = [];
        const robot = document.querySelector(`[data-robot="${arguments[0]}"]`);
        const note = () => window.seen.push(robot.getAttribute("transform"));
        note();
        new MutationObserver(note).observe(robot, {attributes: true});
    """
    browser.open(page_of("door"))
    assert browser.run('return performance.getEntriesByType("resource").length') == 0
    browser.run(watch, "quad")
    for _ in range(3):
        browser.press("+")
    assert browser.one("select[aria-label='Speed']").get_attribute("value") == "32"
    # The page itself checks, two frames later, whether it plays: before the next query of this
    # test, a slow machine could have played to the end.
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


def test_a_page_shows_the_state_of_the_trace_at_each_tick(browser: Browser) -> None:
    """It is readable in both themes."""
    run, page = run_of("chain"), page_of("chain")
    for tick in (0, 6, run.last):
        browser.open(page, f"#tick={tick}")
        assert browser.tick == tick
        for obstacle in run.hidden.values():
            status = obstacle.status.at(tick).value
            for where in (".knowledge", ".obstacles"):
                shown = browser.one(f'{where} [data-obstacle="{obstacle.name}"]')
                assert shown.get_attribute("data-status") == status
        for track in run.robots:
            row, col = run.map.position(track.regions[tick])
            assert browser.centre(track.name) == pytest.approx((col, row), abs=0.3)
    for scheme in ("light", "dark"):
        _texts_are_readable(browser, page, scheme)


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


def test_event_links_keys_and_addresses_open_their_ticks(browser: Browser) -> None:
    """A user opens ticks by events, by keys (wherever the focus is) and by address; zooms in;
    follows a robot, its current target and its route; and finds a name on everything."""
    browser.open(page_of("door"))
    browser.click('.event[data-kind="resolved"]')
    assert browser.tick == 16
    current = browser.all('.event[aria-current="step"]')
    assert {event.get_attribute("data-tick") for event in current} == {"16"}
    browser.click('.marks button[data-tick="11"]')
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
    browser.open(page_of("door"), "#tick=12")
    assert browser.tick == 12
    browser.press(Keys.ARROW_RIGHT)
    browser.wait(lambda: browser.run("return location.hash") == "#tick=13")
    browser.go(30)
    browser.go(4711, shown=46)

    browser.press("f")
    whole = view(browser)
    assert whole[0] <= 0.5 and whole[1] <= 0.5 and whole[0] + whole[2] >= 12.5
    browser.press("i")
    assert view(browser)[2] == pytest.approx(whole[2] / 1.5, rel=0.01)
    before = view(browser)
    browser.press("d")
    assert view(browser)[0] > before[0]
    browser.click("Zoom in")
    assert view(browser)[2] == pytest.approx(whole[2] / 2.25, rel=0.01)
    browser.press("f")
    assert view(browser) == pytest.approx(whole, abs=0.01)
    browser.press("r")
    for tick in (0, 9):
        browser.go(tick)
        x, y, width, height = view(browser)
        name = browser.run("return document.querySelector('.motion [data-robot]').dataset.robot")
        col, row = browser.centre(name)
        assert (x + width / 2, y + height / 2) == pytest.approx((col + 0.5, row + 0.5), abs=0.1)

    _targets_are_shown(browser, 12)
    _everything_has_a_name_and_shows_its_focus(browser)
    assert not browser.errors()


def _targets_are_shown(browser: Browser, tick: int) -> None:
    """Each robot's current target, and the route there."""
    browser.go(tick)
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
    browser.go(11)
    told = browser.one(".map").get_attribute("aria-label") or ""
    assert "quad in region 46 [3, 7]" in told and "door@47 requested" in told
    story = browser.one(".story")
    assert story.get_attribute("aria-live") == "polite"
    assert "it stays; quad requests help" in story.text, "a sentence begins in lower case"
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


def test_a_large_map_fits_every_screen(browser: Browser) -> None:
    """Opened on a phone, and in a window that becomes narrower: nothing needs sideways scrolling.
    The map comes nearer to the region of an event."""
    for width in (390, 1920, 1280, 900, 700, 320):
        if width in (390, 1920):
            browser.open(page_of("crowd"), "#tick=6", width=width, height=800)
        else:
            browser.resize(width, 800)
            browser.wait(lambda width=width: browser.run("return innerWidth") == width)
        assert browser.run("return document.documentElement.scrollWidth") <= width
        wide = "return arguments[0].scrollWidth - arguments[0].clientWidth"
        assert not browser.run(wide, browser.one(".robots")), "a long name is wrapped"
        for selector in (".map", ".controls", "aside", "header"):
            box = browser.one(selector).rect
            assert box["x"] >= 0 and box["x"] + box["width"] <= width + 0.5, selector
        assert browser.one(".map").rect["height"] > 80
    browser.open(page_of("crowd"), **PHONE)
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


def test_failed_and_truncated_runs_are_shown(browser: Browser, tmp_path: Path) -> None:
    """One that failed opens at its last moment."""
    why = {"outcome": "operator_needed", "explanation": "-", "cause": "no_capable_robot"}
    failed = changed("door", [{"line": ["outcome"], "fields": why}], tmp_path)
    browser.open(paged(failed, tmp_path))
    assert browser.tick == 46
    browser.open(tmp_path / "page.html", "#tick=3")
    browser.wait(lambda: browser.tick == 3)
    cut, whole = tmp_path / "cut.jsonl", trace_of("door").read_text()
    cut.write_text(whole[: len(whole) // 2])
    browser.open(paged(cut, tmp_path))
    assert browser.errors() == []
    assert browser.one(".badge").text == "cut off"


def test_loads_charges_and_beliefs_of_the_selected_robot_are_shown(browser: Browser) -> None:
    browser.open(page_of("meeting"), "#tick=1")
    (belief,) = browser.all(".shading .belief")
    assert belief.get_attribute("data-viewer") == "west"
    assert belief.get_attribute("data-of") == "east"
    (area, _) = belief.find_elements("css selector", "path")
    assert (area.get_attribute("d") or "").count("M") == 3  # rows of the room
    for _ in range(2):
        browser.press(Keys.ARROW_RIGHT)
    assert "seen" in (browser.one(".shading .belief").get_attribute("class") or "")
    browser.press(Keys.ARROW_LEFT)
    browser.press(Keys.ARROW_LEFT)
    for selected, viewer in ((1, "east"), (0, "west")):
        browser.run("arguments[0].click()", browser.all(".robots .go")[selected])
        shown = [e.get_attribute("data-viewer") for e in browser.all(".shading .belief")]
        assert shown == [viewer]
    assert not browser.all(".shading path[class]")
    carriers = run_of("loads").hidden["pallet@71"].loads
    taken = next(tick for tick, by in carriers if by)
    for tick in (taken - 1, taken):
        shown = tick == taken
        browser.open(page_of("loads"), f"#tick={tick}")
        sign = browser.one('[data-robot="carrier"] .load').get_attribute("visibility")
        assert sign == ("visible" if shown else "hidden")
        assert ("carries pallet@shelf" in browser.one(".robots").text) == shown
        assert bool(browser.all('[data-obstacle="pallet@71"] rect[fill="none"]')) == shown
    browser.open(page_of("charges"), "#tick=8")  # 15 of 20, 4 more in a tick at home, 7 steps
    assert browser.one(".robots .charge").text.strip() == "60 %"
    out = next(tick for tick, away in run_of("battery").track("digit").out if away)
    browser.open(page_of("battery"), f"#tick={out}")
    assert browser.one(".robots .badge").text == "out of service"
    assert "digit is out of service" in browser.one(".story").text
    signs = [each.get_attribute("visibility") for each in browser.all(".motion .out")]
    assert signs == ["visible", "hidden", "hidden"]
    assert browser.errors() == []


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


def test_all_names_are_legible_and_none_lies_over_another(browser: Browser) -> None:
    """Two lines of words cover no region, not even the last row of tall maps."""
    browser.open(page_of("clinic"), **DESK)
    names = boxes(browser, ".words .names text")
    assert len(names) == 20  # 18 regions and 2 areas
    regions = browser.run(REGIONS)
    frame = browser.one(".map").rect
    for name, box in names.items():
        assert box["size"] > 8.99, name  # the least size is 9, in coordinates that are rounded
        assert inside(box, regions[name]), f"{name} stands in another region"
        assert box["left"] >= frame["x"] - 1 and box["right"] <= frame["x"] + frame["width"] + 1
    pairs = combinations(names.items(), 2)
    assert [(one, other) for (one, a), (other, b) in pairs if not apart(a, b)] == []
    script = "return [...document.querySelectorAll('.map > svg')].map(s => s.classList[0])"
    layers = browser.run(script)
    assert layers.index("words") < layers.index("motion"), "a robot covers the name of its region"

    browser.open(page_of("clinic"), f"#tick={browser.run(LOUDEST)}", **DESK)
    words = browser.one(".story").rect
    assert words["height"] > 40
    lowest = max(top + side for areas in browser.run(REGIONS).values() for _, top, side in areas)
    assert lowest <= words["y"] + 1
    assert not browser.errors()


@pytest.fixture(scope="module")
def solid() -> Iterator[Browser]:
    found = Browser(solid=True)
    yield found
    found.driver.quit()


PICTURE = """
    const canvas = document.querySelector(".stage3d canvas");
    const copy = document.createElement("canvas");
    copy.width = 64; copy.height = 36;
    const brush = copy.getContext("2d");
    brush.drawImage(canvas, 0, 0, 64, 36);
    return [...brush.getImageData(0, 0, 64, 36).data];
"""


def test_the_3d_page_moves_and_its_words_and_picture_show_one_moment(solid: Browser) -> None:
    """The words change when the bodies do: at the instant at which the push has ended."""
    page = page_of("door", "--3d")

    def opened(scheme: str) -> int:
        """The brightness of the corner of the picture."""
        solid.open(page, "#t=20.5", scheme=scheme)
        solid.wait(lambda: solid.all(".stage3d canvas"))
        solid.wait(lambda: sum(solid.run(PICTURE)[:3]))
        return sum(solid.run(PICTURE)[:3])

    light = opened("light")
    before = solid.run(PICTURE)
    assert len({*before}) > 8, "the scene is blank"
    solid.press(Keys.END)
    solid.wait(lambda: solid.seconds > 200)
    assert solid.run(PICTURE) != before
    for key, camera in (("r", "0"), ("f", "orbit")):
        solid.press(key)
        assert solid.run('return document.querySelector(".cameras").value') == camera

    ((*_, begin, end),) = data_of(page, "motion")["actions"]
    for seconds, status, words in (
        (begin - 0.3, "requested", "quad requests help"),
        (end - 0.3, "requested", "quad requests help"),
        (end + 0.3, "resolved", "digit at 47 resolves door@47"),
    ):
        solid.run("location.hash = arguments[0]", f"#t={seconds:.1f}")
        solid.wait(lambda at=seconds: abs(solid.seconds - at) < 0.06)
        door = solid.one('.obstacles [data-obstacle="door@47"]')
        assert door.get_attribute("data-status") == status
        assert words in solid.one(".story").text
        assert ("helps" in solid.one(".robots").text) == (status == "requested")
    assert opened("dark") < light
    assert solid.errors() == []
