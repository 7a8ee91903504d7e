"""Pictures and films: nothing overlaps, nothing is cut off, each form is a real file of the right
size and colours, from the same drawing; `test_transcripts.py` has whole ones."""

import io
import re
import sys
from itertools import combinations
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from msgspec.structs import replace

from once import SCENARIOS
from report.runs import own, run_of
from safenav import RegionMap, UsageError, built_in, load_scenario, load_scenario_text
from safenav.report.picture.film import Film
from safenav.report.picture.floor import placed_names
from safenav.report.picture.scene import svg_of, svg_of_scenario
from safenav.report.picture.svg import (
    obstacle_pictogram,
    png_of,
    robot_pictogram,
    separated,
    text_width,
)
from safenav.report.terminal.story import scenario_text
from safenav.run.values import BLUE, ORANGE
from safenav.studio.drawing import drawing_of

resvg_py = pytest.importorskip("resvg_py", reason="PNG needs the extra `pictures` (resvg-py)")
Image = pytest.importorskip("PIL.Image", reason="GIF needs the extra `pictures` (pillow)")

SVG = "{http://www.w3.org/2000/svg}"
Box = tuple[float, float, float, float]


def _texts(svg: str) -> list[tuple[str, Box]]:
    """All texts outside the map, with the boxes that they take."""
    found = []
    for element in ElementTree.fromstring(svg).findall(f"{SVG}text"):
        words, size = element.text or "", float(element.attrib["font-size"])
        x, y = float(element.attrib["x"]), float(element.attrib["y"])
        width = text_width(words, size, element.get("font-weight") == "bold")
        if element.get("text-anchor") == "middle":
            x -= width / 2
        found.append((words, (x, y - 0.8 * size, x + width, y + 0.2 * size)))
    return found


@pytest.mark.parametrize(("name", "tick"), [("door", 11), ("chain", 6), ("crowd", 137)])
def test_no_text_overlaps_another_or_leaves_the_page(name: str, tick: int) -> None:
    svg = svg_of(run_of(name), tick)
    root = ElementTree.fromstring(svg)
    width, height = float(root.attrib["width"]), float(root.attrib["height"])
    texts = _texts(svg)
    assert len(texts) > 8
    for words, (left, top, right, bottom) in texts:
        assert left >= 0 and top >= 0 and right <= width and bottom <= height, words
    for (words, (l1, t1, r1, b1)), (other, (l2, t2, r2, b2)) in combinations(texts, 2):
        assert r1 <= l2 or r2 <= l1 or b1 <= t2 or b2 <= t1, f"{words!r} overlaps {other!r}"


def test_robots_over_one_another_are_drawn_apart() -> None:
    (r0, c0), (r1, c1), far = separated([(2.0, 3.0), (2.0, 3.0), (2.0, 5.0)])
    assert ((r0 - r1) ** 2 + (c0 - c1) ** 2) ** 0.5 > 0.55
    assert far == (0.0, 0.0)


def test_orders_and_exclusions_are_drawn_before_any_run() -> None:
    scenario = load_scenario_text(own("zone"), "zone.yaml")
    text = scenario_text(scenario, width=100)
    assert "  at most one of a and b is in 8-9 at a time" in text
    assert any("parcel@dock: ordered at tick 4 at dock" in line for line in text)
    drawn = svg_of_scenario(scenario)
    words = [text for text, _ in _texts(drawn)]
    assert "not ordered yet, needs 'push'" in words and '"9 3 2 3"' in drawn
    still = drawing_of(own("zone"), scenario.map, scenario.catalogue)["run"]
    assert still["exclusions"] == [[["a", "b"], [8, 9]]] and still["obstacles"][0]["ordered"]
    assert still["robots"][0]["tasks"][0][2:] == [[8], [10]]  # targets, and regions to avoid


@pytest.mark.parametrize("name", ["warehouse", "hospital"])
def test_figures_can_be_read(name: str) -> None:
    svg = svg_of_scenario(load_scenario(SCENARIOS / f"{name}.yaml"))
    assert min(map(float, re.findall('font-size="([0-9.]+)"', svg))) >= 8


def test_the_name_of_a_narrow_area_stays_inside_it() -> None:
    area = frozenset({7, 12, 17})
    world = RegionMap.from_grid(["#####", *["#...#"] * 3, "#####"], areas={"laboratory": area})
    (name,) = placed_names(world, 48)
    assert {*name.regions} <= area


def _rgb(colour: str) -> tuple[int, ...]:
    return tuple(int(colour[i : i + 2], 16) for i in (1, 3, 5))


def test_a_png_has_the_requested_width_and_shows_the_robots() -> None:
    image = Image.open(io.BytesIO(png_of(svg_of(run_of("door"), 11), width=900))).convert("RGB")
    assert image.size[0] == 900
    counts = {colour: count for count, colour in image.getcolors(1 << 24)}
    assert counts.get(_rgb(BLUE), 0) > 300 and counts.get(_rgb(ORANGE), 0) > 300


@pytest.mark.parametrize(("title", "own"), [("Übung → λ", True), ("№ 7", False), ("机器人", False)])
def test_letters_missing_in_the_fonts_are_drawn_by_the_system(
    monkeypatch: pytest.MonkeyPatch, title: str, own: bool
) -> None:
    """They were left out."""
    asked: list[bool] = []
    drawn = resvg_py.svg_to_bytes

    def watched(**options: Any) -> bytes:
        asked.append(options["skip_system_fonts"])
        return bytes(drawn(**options))

    monkeypatch.setattr(resvg_py, "svg_to_bytes", watched)
    png_of(svg_of(replace(run_of("door"), name=title), 0), width=200)
    assert asked == [own]


def test_a_film_rests_at_events_and_has_the_plain_colours_of_the_picture(tmp_path: Path) -> None:
    path, frames = tmp_path / "door.gif", list[None]()
    film = Film(run_of("door"), range(9, 20), speed=4, width=400)
    film.write_gif(path, lambda: frames.append(None))
    assert len(frames) == len(film.moments)
    durations = []
    with Image.open(path) as gif:
        assert gif.size[0] == 400
        for i in range(gif.n_frames):
            gif.seek(i)
            durations.append(gif.info["duration"])
            if i == 1:
                left, _, right, _ = gif.tile[0][1]
                assert right - left < 400, "a frame holds only what differs"
        colours = {colour for _, colour in gif.convert("RGB").getcolors(256)}
    # The frames, the violation, the resolution, the end.
    assert sum(durations) == len(frames) * 100 + 1200 + 1200 + 2500
    assert max(durations[:-1]) >= 1200
    assert {_rgb(colour) for colour in ("#ffffff", BLUE, ORANGE, "#009e73")} <= colours


def test_white_stays_white_in_a_large_film(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pillow's own palettes hold other colours, in large pictures even another white."""
    white, path = Image.new("RGB", (4200, 4200), "white"), tmp_path / "white.gif"
    monkeypatch.setattr(Film, "_frame", lambda *_: white)
    Film(run_of("door"), range(11, 12)).write_gif(path)
    with Image.open(path) as gif:
        assert gif.convert("RGB").getpixel((0, 0)) == (255, 255, 255)


def test_a_missing_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    svg = svg_of(run_of("door"), 0)
    monkeypatch.setitem(sys.modules, "resvg_py", None)
    with pytest.raises(UsageError, match="resvg-py>="):
        png_of(svg)
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(UsageError, match="pillow"):
        Film(run_of("door"), range(2)).write_gif(tmp_path / "x.gif")


def test_every_robot_and_obstacle_has_a_silhouette_and_so_have_those_named_like_them() -> None:
    library = built_in()
    for names, shape in (
        (library.robots, robot_pictogram),
        (library.obstacles, obstacle_pictogram),
    ):
        for name in names:
            assert shape(name) == shape(f"my_{name}") == shape(f"my-{name}") != ""
    assert obstacle_pictogram("fire_door") == obstacle_pictogram("door")
    assert obstacle_pictogram("my_pulled_door") != obstacle_pictogram("door")
    assert robot_pictogram("rover") == obstacle_pictogram("trapdoor") == ""
