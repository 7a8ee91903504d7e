"""Images with a legend: colours of walls, floor and areas; labels; effects of a share."""

import re
from pathlib import Path

import pytest
from PIL import Image, ImageDraw, ImageFont

from safenav.errors import InputError
from safenav.scenario.reading.loader import load_scenario_text
from safenav.world.map import RegionMap
from tests.warm import safenav

PLAN = """\
#############
#.....#.....#
#.....#.....#
#...........#
#.....#.....#
#############""".splitlines()
SIDE = 40
WARD = {RegionMap.from_grid(PLAN).region(row, col) for row in (1, 2) for col in range(7, 12)}


def plan(folder: Path, *labels: tuple[int, int, str], thin: int = SIDE) -> Path:
    """The plan as a picture, its north-eastern part yellow; inner walls ``thin`` pixels wide."""
    picture = Image.new("RGB", (len(PLAN[0]) * SIDE, len(PLAN) * SIDE), "white")
    pen = ImageDraw.Draw(picture)
    pen.rectangle((7 * SIDE, SIDE, 12 * SIDE - 1, 3 * SIDE - 1), fill="#ffcc00")
    for row, line in enumerate(PLAN):
        for col, char in enumerate(line):
            inner = 0 < row < len(PLAN) - 1 and 0 < col < len(line) - 1
            width = thin if inner else SIDE
            if char == "#":
                left = col * SIDE + (SIDE - width) // 2
                pen.rectangle((left, row * SIDE, left + width - 1, row * SIDE + SIDE - 1), "black")
    font = ImageFont.load_default(16)
    for x, y, text in labels:
        pen.text((x, y), text, fill="black", font=font)
    picture.save(folder / "plan.png")
    return folder / "plan.png"


def load(folder: Path, image: str, more: str = "") -> RegionMap:
    text = (
        f"safenav: 1\nmap: {{image: {image}, rows: {len(PLAN)}, cols: {len(PLAN[0])}{more}}}\n"
        "robots: {ann: {model: quadcopter, start: [3, 5], objective: {hold: [3, 4]}}}\n"
    )
    return load_scenario_text(text, str(folder / "plan.yaml")).map


LEGEND = '{file: plan.png, legend: {"#000000": wall, "#ffcc00": ward}}'


def test_colours_are_walls_floor_and_areas(tmp_path: Path) -> None:
    plan(tmp_path)
    world = load(tmp_path, LEGEND)
    assert world.grid_rows() == PLAN
    assert world.areas == {"ward": WARD}
    assert world.notes == ()


def test_labels_in_the_colour_of_walls_are_not_walls(tmp_path: Path) -> None:
    plan(tmp_path, (50, 60, "Pharmacy 2.1"), (310, 70, "WARD A"), (60, 170, "corridor"))
    world = load(tmp_path, LEGEND)
    assert world.grid_rows() == PLAN
    assert world.areas == {"ward": WARD}
    assert "3 labels (at 14 [1, 1]" in world.notes[0]
    as_drawn = load(tmp_path, LEGEND.replace("}}", "}, text: wall}"))
    assert len(as_drawn.walls) > len(world.walls)
    plain = load(tmp_path, "plan.png")
    assert plain.walls >= as_drawn.walls
    assert "3 labels" in plain.notes[0] and "text: ignore" in plain.notes[0]


def test_pillars_and_single_spots_stay_walls(tmp_path: Path) -> None:
    file = plan(tmp_path)
    picture = Image.open(file)
    pen = ImageDraw.Draw(picture)
    for left in (60, 72, 84, 96):
        pen.rectangle((left, 60, left + 7, 67), "black")
    pen.rectangle((130, 180, 138, 192), "black")
    picture.save(file)
    world = load(tmp_path, LEGEND)
    assert {world.position(r) for r in world.walls - RegionMap.from_grid(PLAN).walls} == {
        (1, 1),
        (1, 2),
        (4, 3),
    }


def test_a_share_that_removes_walls_is_a_warning(tmp_path: Path) -> None:
    plan(tmp_path, thin=4)
    assert load(tmp_path, LEGEND).grid_rows() == PLAN
    world = load(tmp_path, LEGEND, ", share: 0.3")
    assert world.is_free(world.region(1, 6))
    assert "a share of 0.3 removes a wall: 2 regions from 19 [1, 6] to 32 [2, 6]" in world.notes[0]
    (tmp_path / "plan.yaml").write_text(
        f"safenav: 1\nmap: {{image: {LEGEND}, rows: 6, cols: 13, share: 0.3}}\n"
        "robots: {ann: {model: quadcopter, start: [1, 1], objective: {patrol: [[1, 2], ward]}}}\n"
    )
    for command in ("check", "draw", "run"):
        done = safenav(command, "plan.yaml", cwd=tmp_path)
        assert done.returncode == 0
        assert "warning: a share of 0.3 removes a wall" in done.stderr
    assert "ann reaches ward 20 [1, 7]" in done.stdout


def test_a_division_that_removes_a_room_or_a_passage_is_a_warning(tmp_path: Path) -> None:
    picture = Image.new("L", (400, 300), 255)
    pen = ImageDraw.Draw(picture)
    pen.rectangle((0, 0, 399, 299), outline=0, width=10)
    pen.rectangle((198, 0, 202, 120), 0)
    pen.rectangle((198, 150, 202, 299), 0)
    pen.rectangle((290, 190, 350, 250), outline=0, width=10)
    picture.save(tmp_path / "plan.png")
    done = safenav("draw", "plan.png", "--rows", "6", "--cols", "8", cwd=tmp_path)
    assert "removes a room: 41 x 41 pixels around pixel [220, 320]" in done.stderr
    assert "are cut off: the image has a passage that is narrower" in done.stderr


def test_an_undivided_image_is_refused_with_options_that_work(tmp_path: Path) -> None:
    plan(tmp_path)
    for options in ([], ["--side", "0.5"]):
        asked = safenav("draw", "plan.png", *options, cwd=tmp_path)
        assert asked.returncode == 2
        assert "520 x 240 pixels" in asked.stderr
        words = re.search(r"add (--rows \d+ --cols \d+)", asked.stderr)
        assert words is not None
        done = safenav("draw", "plan.png", *options, *words[1].split(), cwd=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        assert "·" in done.stdout or "14" in done.stdout


@pytest.mark.parametrize(
    ("image", "told"),
    [
        ("{legend: {}}", "the key 'file' is missing"),
        ('{file: plan.png, legend: {"#ffcc00": ward}}', "legend without walls"),
        ("{file: plan.png, legend: {black: wall}}", "'black' is not a colour"),
        ('{file: plan.png, legend: {"#000000": wall, "#00ff00": lab}}', "no region has the colour"),
        ('{file: plan.png, legend: {"#000000": wall, "#ffcc00": 3rd}}', "cannot name an area"),
        ("{file: plan.png, text: keep}", "unknown word 'keep'"),
    ],
)
def test_a_wrong_legend_is_reported(image: str, told: str, tmp_path: Path) -> None:
    plan(tmp_path)
    with pytest.raises(InputError, match=told):
        load(tmp_path, image)
