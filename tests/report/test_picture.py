"""Pictures: nothing overlaps, nothing is cut off; `test_transcripts.py` has whole ones."""

import re
from xml.etree import ElementTree

import pytest

from once import SCENARIOS, beside
from safenav.report.picture.floor import placed_names
from safenav.report.picture.scene import svg_of, svg_of_scenario
from safenav.report.picture.svg import separated, text_width
from safenav.report.terminal.story import scenario_text
from safenav.run.run import Run
from safenav.scenario.reading.loader import load_scenario, load_scenario_text
from safenav.studio.drawing import drawing_of
from safenav.world.map import RegionMap

SVG = "{http://www.w3.org/2000/svg}"
MOMENTS = [("door", 11), ("chain", 6), ("crowd", 137)]

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


@pytest.mark.parametrize(("name", "tick"), MOMENTS)
def test_no_text_overlaps_another_or_leaves_the_page(
    replays: dict[str, Run], name: str, tick: int
) -> None:
    svg = svg_of(replays[name], tick)
    root = ElementTree.fromstring(svg)
    width, height = float(root.attrib["width"]), float(root.attrib["height"])
    texts = _texts(svg)
    assert len(texts) > 8
    for i, (words, (left, top, right, bottom)) in enumerate(texts):
        assert left >= 0 and top >= 0 and right <= width and bottom <= height, words
        for other, (l2, t2, r2, b2) in texts[:i]:
            apart = right <= l2 or r2 <= left or bottom <= t2 or b2 <= top
            assert apart, f"{words!r} overlaps {other!r}"


def test_robots_over_one_another_are_drawn_apart() -> None:
    (r0, c0), (r1, c1), far = separated([(2.0, 3.0), (2.0, 3.0), (2.0, 5.0)])
    assert ((r0 - r1) ** 2 + (c0 - c1) ** 2) ** 0.5 > 0.55
    assert far == (0.0, 0.0)


ZONE = beside(__file__, "scenarios/zone.yaml")


def test_orders_and_exclusions_are_drawn_before_any_run() -> None:
    scenario = load_scenario_text(ZONE, "zone.yaml")
    text = scenario_text(scenario, width=100)
    assert "  at most one of a and b is in 8-9 at a time" in text
    assert any("parcel@dock: ordered at tick 4 at dock" in line for line in text)
    drawn = svg_of_scenario(scenario)
    words = [text for text, _ in _texts(drawn)]
    assert "not ordered yet, needs 'push'" in words and '"9 3 2 3"' in drawn
    still = drawing_of(ZONE, scenario.map, scenario.catalogue)["run"]
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
