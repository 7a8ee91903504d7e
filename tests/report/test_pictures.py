"""Pictures and films: nothing overlaps, nothing is cut off, each form is a real file of the right
size and colours, from the same drawing; `test_transcripts.py` has whole ones."""

import re
from itertools import combinations
from math import dist
from pathlib import Path
from xml.etree import ElementTree

import pytest

from once import SCENARIOS
from report.runs import own, picture_of, run_of
from safenav.report.picture.scene import svg_of
from safenav.report.picture.svg import FONTS, GLYPHS, text_width
from safenav.run.values import StoryKind
from warm import safenav

ImageFont = pytest.importorskip("PIL.ImageFont", reason="GIF needs the extra `pictures` (pillow)")
pytest.importorskip("resvg_py", reason="PNG needs the extra `pictures` (resvg-py)")

from PIL import Image  # noqa: E402

SVG = "{http://www.w3.org/2000/svg}"
BLUE, ORANGE = "#0072B2", "#E69F00"
Box = tuple[float, float, float, float]


def _texts(svg: str, within: str = "") -> list[tuple[str, Box]]:
    """All texts outside the map, or ``within`` a drawing, with the boxes that they take in the
    fonts of pixels."""
    found = []
    for element in ElementTree.fromstring(svg).findall(f"{within}{SVG}text"):
        words, size = element.text or "", float(element.attrib["font-size"])
        x, y = float(element.attrib["x"]), float(element.attrib["y"])
        bold = "-Bold" if element.get("font-weight") == "bold" else ""
        font = ImageFont.truetype(str(FONTS / f"DejaVuSans{bold}.ttf"), 100)
        width = font.getlength(words) * size / 100
        if element.get("text-anchor") == "middle":
            x -= width / 2
        found.append((words, (x, y - 0.8 * size, x + width, y + 0.2 * size)))
    return found


def drawn(scenario: Path | str, folder: Path) -> tuple[str, str]:
    """A scenario as text and as picture."""
    path = scenario if isinstance(scenario, Path) else folder / "drawn.yaml"
    if isinstance(scenario, str):
        path.write_text(scenario)
    done = [safenav("draw", path, *more) for more in ((), ("-o", folder / "drawn.svg"))]
    assert [each.returncode for each in done] == [0, 0], done
    return done[0].stdout, (folder / "drawn.svg").read_text()


@pytest.mark.parametrize(("name", "tick"), [("door", 11), ("chain", 6), ("crowd", 137)])
def test_no_text_overlaps_another_or_leaves_the_page(name: str, tick: int, tmp_path: Path) -> None:
    svg = picture_of(name, tmp_path, "--at", str(tick)).read_text()
    root = ElementTree.fromstring(svg)
    width, height = float(root.attrib["width"]), float(root.attrib["height"])
    texts = _texts(svg)
    assert len(texts) > 8
    for words, (left, top, right, bottom) in texts:
        assert left >= 0 and top >= 0 and right <= width and bottom <= height, words
    for (words, (l1, t1, r1, b1)), (other, (l2, t2, r2, b2)) in combinations(texts, 2):
        assert r1 <= l2 or r2 <= l1 or b1 <= t2 or b2 <= t1, f"{words!r} overlaps {other!r}"


LABORATORY = """\
safenav: 1
map: {grid: ["#####", "#...#", "#...#", "#...#", "#####"]}
areas: {laboratory: [7, 12, 17]}
robots:
  quad: {model: quadcopter, start: 8, objective: {hold: 8}}
  digit: {model: digit, start: 8, heading: north, objective: {hold: 8}}
""" + "".join(
    f"  {name}: {{model: x500, start: 11, objective: {{hold: 11}}, avoids: []}}\n"
    for name in ("ant", "bee", "cow", "elk")
)


def test_robots_in_one_region_are_drawn_apart_and_a_narrow_area_name_is_shortened(
    tmp_path: Path,
) -> None:
    text, svg = drawn(LABORATORY, tmp_path)
    assert "QD" in text
    texts = dict(_texts(svg, f"{SVG}svg/"))
    side = 48
    (left, _, right, bottom) = texts["labora…"]
    assert 2 * side <= left < right <= 3 * side and bottom <= 4 * side
    quad, digit = ((texts[each][0], texts[each][1]) for each in "QD")
    assert 0.5 * side < dist(quad, digit) < side
    four = [texts[each][:2] for each in "ABCE"]
    assert all(dist(one, other) > 0.3 * side for one, other in combinations(four, 2))


def test_orders_and_exclusions_are_in_the_picture_of_a_scenario(tmp_path: Path) -> None:
    text, svg = drawn(own("zone"), tmp_path)
    assert "parcel@loading_dock: ordered at tick 4 at loading_dock" in text
    assert '"9 3 2 3"' in svg


def test_widths_of_texts_are_those_of_the_font() -> None:
    font = ImageFont.truetype(str(FONTS / "DejaVuSans.ttf"), 1000)
    for char in map(chr, range(32, 127)):
        assert text_width(char, 1000) == round(font.getlength(char)), char


def test_a_robot_out_of_service_is_marked() -> None:
    run = run_of("battery")
    out = next(tick for tick, away in run.track("digit").out if away)
    signs = [svg_of(run, tick).count(GLYPHS.events[StoryKind.SERVICE]) for tick in (out - 1, out)]
    assert signs == [0, 1]


@pytest.mark.parametrize("name", ["warehouse", "hospital"])
def test_text_of_figures_is_large_enough_to_read(name: str, tmp_path: Path) -> None:
    _, svg = drawn(SCENARIOS / f"{name}.yaml", tmp_path)
    assert min(map(float, re.findall('font-size="([0-9.]+)"', svg))) >= 8


LARGE = f"""\
safenav: 1
map: {{grid: ["{"." * 100}"], names: {{dock: 7}}}}
robots: {{{"rover_" * 12}: {{model: husky, start: 2, objective: {{hold: dock}}}}}}
obstacles: [{{type: door, region: 5}}]
"""


def test_small_regions_have_no_words_and_long_names_are_cut(tmp_path: Path) -> None:
    _, svg = drawn(LARGE, tmp_path)
    assert [text for text, _ in _texts(svg, f"{SVG}svg/")] == ["R"] and "scale(5)" in svg
    ((name, (left, _, right, _)),) = [each for each in _texts(svg) if "rover_" in each[0]]
    assert name.endswith(" ...") and right - left < 170


def _rgb(colour: str) -> tuple[int, ...]:
    return tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5))


def test_a_png_has_the_requested_width_and_shows_the_robots(tmp_path: Path) -> None:
    picture = picture_of("door", tmp_path, "--at", "11", "--width", "900", form="png")
    with Image.open(picture) as image:
        assert image.size[0] == 900
        colours = image.convert("RGB").getcolors(1 << 24) or []
    counts = {colour: count for count, colour in colours}
    assert counts.get(_rgb(BLUE), 0) > 300 and counts.get(_rgb(ORANGE), 0) > 300


def test_a_gif_pauses_at_events_and_has_the_plain_colours_of_the_picture(tmp_path: Path) -> None:
    more = ("--width", "400")
    durations = []
    with Image.open(picture_of("door", tmp_path, *more, form="gif")) as gif:
        assert gif.size[0] == 400
        for i in range(gif.n_frames):
            gif.seek(i)
            durations.append(gif.info["duration"])
            if i == 1:
                left, _, right, _ = gif.tile[0][1]
                assert right - left < 400, "a frame holds only what differs"
        colours = {colour for _, colour in gif.convert("RGB").getcolors(256)}
    # The violation, the resolution, the end.
    assert [each for each in durations if each > 100] == [1300, 1300, 2600]
    assert {_rgb(colour) for colour in ("#ffffff", BLUE, ORANGE, "#009e73")} <= colours
