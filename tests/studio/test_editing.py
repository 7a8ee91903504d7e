"""An edit of the drawing changes only its own part of the text."""

import difflib
import os
import random
from contextlib import suppress
from typing import Any

import pytest

from safenav.errors import UsageError
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.reading.loader import load_draft, load_scenario_text
from safenav.studio import editing
from safenav.studio.drawing import drawing_of
from safenav.studio.editor import blank
from safenav.world.poses import Mobility
from studio.serving import SCENARIOS

DOOR = (SCENARIOS / "case_study_1.yaml").read_text()
SEQUENCES = int(os.environ.get("SAFENAV_FUZZ", "0")) // 25 or 6
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))


def lines(before: str, after: str) -> list[str]:
    """The lines that differ, as a diff shows them."""
    told = difflib.unified_diff(before.splitlines(), after.splitlines(), n=0, lineterm="")
    return [line for line in told if line[0] in "+-" and line[:3] not in ("+++", "---")]


@pytest.mark.parametrize(
    ("operation", "change"),
    [
        (
            {"op": "paint", "regions": [44], "wall": True},
            ["-    #...#.......#", "+    #...##......#"],
        ),
        (
            {"op": "set_heading", "robot": "digit", "heading": "north"},
            [
                "-  digit: {model: digit, start: 71, heading: east, objective: {patrol: [58, 28]}}",
                "+  digit: {model: digit, start: 71, heading: north, "
                "objective: {patrol: [58, 28]}}",
            ],
        ),
        (
            {"op": "add_obstacle", "type": "door", "region": 44, "from": 12},
            ["+  - {type: door, region: 44, from: 12}"],
        ),
    ],
)
def test_an_edit_changes_only_its_lines(operation: dict[str, Any], change: list[str]) -> None:
    assert lines(DOOR, edited(DOOR, operation)) == change


def test_all_robots_and_obstacles_of_the_library_can_be_drawn() -> None:
    library = built_in()
    text = DOOR.replace("obstacles:", "requirements: [always(height(quad) > 1)]\nobstacles:")
    free = [r for r in sorted(load_scenario_text(text).map.free) if r not in (14, 71, 47)]
    for name, model in library.robots.items():
        added = {"op": "add_robot", "model": name, "region": free.pop()}
        turns = model.mobility is Mobility.HEADING
        text = edited(text, added | ({"heading": "north"} if turns else {}))
    for name in library.obstacles:
        text = edited(text, {"op": "add_obstacle", "type": name, "region": free.pop()})
    scenario = load_scenario_text(text)
    assert {robot.model.name for robot in scenario.robots} == set(library.robots)
    assert {obstacle.type.name for obstacle in scenario.obstacles} == set(library.obstacles)
    draft = load_draft(text, "library.yaml")
    assert draft.world is not None
    run = drawing_of(text, draft.world, draft.catalogue)["run"]
    assert all(item["shape"] for item in [*run["robots"], *run["obstacles"]])
    assert list(scenario.requirements) == ["always(height(quad) > 1)"]


@pytest.mark.parametrize(
    "operation",
    [
        {"op": "fly"},
        {"op": "paint", "regions": [9999], "wall": True},
        {"op": "move_robot", "robot": "nobody", "region": 14},
        {"op": "remove_obstacle", "index": 7},
        {"op": "paint"},
    ],
)
def test_an_impossible_edit_is_refused(operation: dict[str, Any]) -> None:
    with pytest.raises(UsageError):
        edited(DOOR, operation)


def edited(text: str, operation: dict[str, Any]) -> str:
    return editing.edited(text, operation, load_draft(text, "scenario.yaml").world)


def something(text: str, chance: random.Random) -> dict[str, Any]:
    """An edit, sensible or not."""
    draft = load_draft(text, "scenario.yaml")
    drawing = draft.world and drawing_of(text, draft.world, draft.catalogue)
    assert drawing, "a drawing never loses its map"
    size = drawing["run"]["rows"] * drawing["run"]["cols"]
    names = [robot["name"] for robot in drawing["robots"]] or ["nobody"]
    region, robot = chance.randrange(size), chance.choice(names)
    index = chance.randrange(len(drawing["obstacles"]) + 1)
    kind = chance.choice(("patrol", "visit", "cover", "hold"))
    regions = [chance.randrange(size) for _ in range(2)]
    return chance.choice(
        [
            {"op": "paint", "regions": regions, "wall": chance.random() < 0.4},
            {"op": "add_robot", "model": "digit", "region": region, "heading": "east"},
            {"op": "add_robot", "model": "quadcopter", "region": region},
            {"op": "move_robot", "robot": robot, "region": region},
            {"op": "set_heading", "robot": robot, "heading": "west"},
            {"op": "set_objective", "robot": robot, "kind": kind, "regions": regions},
            {"op": "remove_robot", "robot": robot},
            {"op": "add_obstacle", "type": "door", "region": region},
            {"op": "add_obstacle", "type": "uncertainty", "region": region, "from": 3},
            {"op": "move_obstacle", "index": index, "region": region},
            {"op": "remove_obstacle", "index": index},
            {"op": "set_objective", "robot": robot, "kind": kind, "regions": ["a1", regions]},
        ]
    )


@pytest.mark.parametrize("seed", range(FIRST, FIRST + SEQUENCES))
def test_random_edits_leave_a_text_that_reads_back(seed: int) -> None:
    """Mistakes are diagnostics, never exceptions; what loads saves and loads again the same."""
    chance = random.Random(seed)
    text = blank() if seed % 2 else DOOR[: DOOR.index("expect:")]
    for _ in range(30):
        try:
            text = edited(text, something(text, chance))
        except UsageError as refused:
            assert str(refused)
    draft = load_draft(text, "scenario.yaml")
    if draft.scenario is not None:
        assert load_scenario_text(text).robots == draft.scenario.robots
    else:
        assert draft.diagnostics


COMMENTED = """\
# a house
safenav: 1
name: commented   # its name
map:
  # north is up
  grid: |
    #########
    #...#...#
    #.......#
    #...#...#
    #########
  names: {den: 10}  # where it sleeps
robots:  # the team
  # the first
  quad:
    model: quadcopter  # it flies
    start: den         # above the bed
    objective:         # round and round
      # both rooms
      patrol: [12, 15]  # in turn
  digit: {model: digit, start: 30, heading: east, objective: {hold: 30}}
# unknown to both
obstacles:
- {type: door, region: 22}   # the only door
until: {rounds: 2}  # enough
# the end
"""


def test_comments_stay_through_many_edits_of_the_map() -> None:
    chance, text = random.Random(5), COMMENTED
    for _ in range(80):
        edit = something(text, chance)
        if not edit["op"].startswith("remove"):
            with suppress(UsageError):
                text = edited(text, edit)
    comments = [line.partition("# ")[2] for line in COMMENTED.splitlines() if "# " in line]
    assert len(comments) == 15
    assert all(f"# {comment}" in text for comment in comments), text
    assert load_draft(text, "scenario.yaml").world is not None


@pytest.mark.parametrize(
    ("text", "edit", "after"),
    [
        ("robots: {}\n", {"op": "add_robot", "model": "digit", "region": 4}, "robots:\n  digit: {"),
        ("robots:\n", {"op": "add_robot", "model": "digit", "region": 4}, "robots:\n  digit: {"),
        ("robots: {}", {"op": "repair", "change": [["limits.ticks", "9"]]}, "limits: {ticks: 9}"),
        ("obstacles: []", {"op": "add_obstacle", "type": "door", "region": 4}, "\n  - {type: door"),
        ("obstacles: [{type: a, region: 4}, {type: b, region: 4}]\nlate: stop",
         {"op": "remove_obstacle", "index": 0}, "obstacles: [{type: b, region: 4}]\nlate: stop"),
        ("obstacles: [&o {type: a, region: 4}, *o]",
         {"op": "move_obstacle", "index": 0, "region": 1}, "region: 1}, *o]"),
    ],
)  # fmt: skip
def test_an_edit_fits_any_form_of_the_text(text: str, edit: dict[str, Any], after: str) -> None:
    grid = 'safenav: 1\nmap:\n  grid: ["###", \'#.#\', "###"]\n'
    assert after in edited(grid + text, edit)
    assert '"#.#"' in edited(grid + text, edit).replace("'", '"')


def test_comments_of_a_replaced_objective_stay() -> None:
    hold = {"op": "set_objective", "robot": "quad", "kind": "hold", "regions": [11]}
    listed = "patrol:\n      - 12  # the bed\n      - 15  # the hall"
    text = edited(COMMENTED.replace("patrol: [12, 15]  # in turn", listed), hold)
    assert "patrol" not in text
    assert all(f"# {each}" in text for each in ("both rooms", "the bed", "the hall"))


def test_areas_are_drawn_and_used_as_targets() -> None:
    areas = "areas: {hall: {rows: 1-2, columns: 3}, spots: [[1, 1], {columns: 1-2}]}"
    text = DOOR.replace("robots:", f"{areas}\nrobots:").replace("[54, 49]", "[hall, spots]")
    draft = load_draft(text, "door.yaml")
    assert draft.world is not None
    drawing = drawing_of(text, draft.world, draft.catalogue)
    assert drawing is not None
    assert drawing["robots"][0]["targets"][0] == [16, 29]
    assert drawing["run"]["areas"]["hall"] == [16, 29]
    new = {"op": "set_objective", "robot": "quad", "kind": "patrol", "regions": ["hall", [58, 59]]}
    assert "patrol: [hall, {any: [58, 59]}]" in edited(text, new)


TIMED = DOOR.replace("{patrol: [58, 28]}", "{patrol: [58, 28], within: 40}") + (
    "chargers: [14]\nlate: go_on\nresolve_within: 30\n"
)


def test_promises_stay_when_a_drawing_changes_something_else() -> None:
    """The keys of deadlines and batteries are read, kept, and shown where they stand."""
    assert load_draft(TIMED, "timed.yaml").scenario is not None
    moved = {"op": "set_objective", "robot": "digit", "kind": "visit", "regions": [58, 27]}
    after = edited(TIMED, moved)
    assert "objective: {visit: [58, 27], within: 40}" in after
    assert after.splitlines()[-4:] == TIMED.splitlines()[-4:]
    held = edited(after, {"op": "set_objective", "robot": "digit", "kind": "hold", "regions": [58]})
    assert "objective: {hold: 58}" in held
