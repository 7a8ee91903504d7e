"""The page as people see it: contrast, themes, narrow screens, names for those who hear it."""

from pathlib import Path

import pytest

from report.browser import Browser, Keys

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
