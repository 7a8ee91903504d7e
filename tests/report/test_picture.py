"""Pictures: they are complete, nothing overlaps, nothing is cut off."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

from once import SCENARIOS, beside
from safenav.cli import group
from safenav.report.page.html import encoded
from safenav.report.picture.floor import cell_size, placed_names, window
from safenav.report.picture.scene import EXCLUSION, scene_of, svg_of
from safenav.report.picture.svg import separated, text_width
from safenav.report.terminal.story import scenario_text
from safenav.run.reading import read_run
from safenav.run.run import Run
from safenav.run.values import looks
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
    svg = svg_of(replays[name].at(tick))
    root = ElementTree.fromstring(svg)
    width, height = float(root.attrib["width"]), float(root.attrib["height"])
    texts = _texts(svg)
    assert len(texts) > 8
    for i, (words, (left, top, right, bottom)) in enumerate(texts):
        assert left >= 0 and top >= 0 and right <= width and bottom <= height, words
        for other, (l2, t2, r2, b2) in texts[:i]:
            apart = right <= l2 or r2 <= left or bottom <= t2 or b2 <= top
            assert apart, f"{words!r} overlaps {other!r}"


def test_the_map_is_cropped_and_the_region_of_the_words_has_a_frame(
    replays: dict[str, Run],
) -> None:
    root = ElementTree.fromstring(svg_of(replays["door"].at(11)))
    (floor,) = root.findall(f"{SVG}svg")
    left, upper, width, height = (48 * side for side in window(replays["door"].map))
    assert [float(each) for each in floor.attrib["viewBox"].split()] == [left, upper, width, height]
    assert (left, upper) == (24, 24)
    (frame,) = (each for each in floor.findall(f"{SVG}rect") if each.get("stroke-width") == "1.2")
    assert (float(frame.attrib["x"]), float(frame.attrib["y"])) == (8 * 48 + 3, 3 * 48 + 3)  # door


def test_the_next_target_is_filled_and_the_route_there_dashed(replays: dict[str, Run]) -> None:
    run = replays["door"]
    quad = run.at(0).robots[0]
    assert quad.aim == 54 or quad.aim == 49
    assert quad.ahead[0] == quad.trail[-1] and len(quad.ahead) > 1
    root = ElementTree.fromstring(svg_of(run.at(0)))
    filled = [each for each in root.iter(f"{SVG}circle") if each.get("fill-opacity") == "0.3"]
    assert len([each for each in filled if each.get("fill") != "none"]) == 3  # one in the legend


def test_robots_over_one_another_are_drawn_apart() -> None:
    places = [(2.0, 3.0), (2.0, 3.0), (2.0, 5.0)]
    shifts = separated(places)
    (r0, c0), (r1, c1), far = shifts
    assert ((r0 - r1) ** 2 + (c0 - c1) ** 2) ** 0.5 > 0.55
    assert far == (0.0, 0.0)
    assert separated([(0.0, 0.0), (0.0, 1.0)]) == [(0.0, 0.0), (0.0, 0.0)]


ZONE = beside(__file__, "scenarios/zone.yaml")


def test_orders_and_exclusions_are_drawn_before_any_run(tmp_path: Path) -> None:
    scenario = load_scenario_text(ZONE, "zone.yaml")
    text = scenario_text(scenario, width=100)
    assert "  at most one of a and b is in 8-9 at a time" in text
    assert any("parcel@dock: ordered at tick 4 at dock" in line for line in text)
    drawn = svg_of(scene_of(scenario))
    words = [text for text, _ in _texts(drawn)]
    assert "not ordered yet, needs 'push'" in words and "at most one of a and b at a time" in words
    assert drawn.count(EXCLUSION["stroke_dasharray"]) == 2  # on the map and in the legend
    source, trace = tmp_path / "zone.yaml", tmp_path / "zone.jsonl"
    source.write_text(ZONE)
    group.main(["run", str(source), "--trace", str(trace)], standalone_mode=False)
    run = encoded(read_run(trace), "x")
    assert run["exclusions"] == [[["a", "b"], [8, 9]]] and run["obstacles"][0]["ordered"]
    assert run["robots"][0]["tasks"][0][2:] == [[8], [10]]  # targets, and regions to avoid
    still = drawing_of(ZONE, scenario.map, scenario.catalogue)["run"]
    assert still["exclusions"] == run["exclusions"] and still["obstacles"][0]["ordered"]
    assert still["robots"][0]["tasks"][0][2:] == [[8], [10]]


def test_a_scenario_as_text_shows_numbers_starts_targets_and_obstacles() -> None:
    scenario = load_scenario(SCENARIOS / "case_study_1.yaml")
    text = "\n".join(scenario_text(scenario, width=100))
    for mark in ("Q14", "D71", "q54", "q49", "d58", "d28", "?47"):
        assert re.search(rf"{re.escape(mark)}\b", text), mark
    assert "door@47: hidden at 47 [3, 8], needs push at 47, blocks every robot; " in text


@pytest.mark.parametrize("name", ["warehouse", "hospital"])
def test_figures_can_be_read_and_targets_have_rings_above_names(name: str) -> None:
    scenario = load_scenario(SCENARIOS / f"{name}.yaml")
    world, cell = scenario.map, cell_size(scenario.map)
    root = ElementTree.fromstring(svg_of(scene_of(scenario)))
    sizes = [float(each.attrib["font-size"]) for each in root.iter() if "font-size" in each.attrib]
    assert min(sizes) >= 8
    circles = [{**each.attrib} for each in root.iter(f"{SVG}circle")]
    rings = {
        (each["stroke"], int(float(each["cy"]) // cell), int(float(each["cx"]) // cell)): each
        for each in circles
        if "stroke" in each
    }
    tops = {world.names[n.text]: n.box.top for n in placed_names(world, cell) if not n.area}
    areas = [area for area in world.areas.values() if len(area) > 1]
    for robot, look in zip(scenario.robots, looks([r.name for r in scenario.robots]), strict=True):
        targets = frozenset[int]().union(*robot.objective.targets)
        for region in targets.difference(*(area for area in areas if area <= targets)):
            ring = rings[look.colour, *world.position(region)]
            lower = (world.position(region)[0] + 1) * cell
            assert float(ring["cy"]) + float(ring["r"]) < tops.get(region, lower)


def test_the_name_of_a_narrow_area_stays_inside_it() -> None:
    area = frozenset({7, 12, 17})
    world = RegionMap.from_grid(["#####", *["#...#"] * 3, "#####"], {}, {"laboratory": area})
    (name,) = placed_names(world, 48)
    cols = range(int(name.box.left // 48), int(name.box.right // 48) + 1)
    rows = range(int(name.box.top // 48), int(name.box.bottom // 48) + 1)
    assert {world.region(r, c) for r in rows for c in cols} <= area
