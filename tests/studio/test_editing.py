"""An edit of the drawing changes only its own part of the text."""

import difflib
import os
import random
from contextlib import suppress
from typing import Any

import pytest

from once import SCENARIOS, beside, from_yaml
from safenav import UsageError, built_in, load_scenario_text
from safenav.scenario.reading.loader import load_draft
from safenav.studio import editing
from safenav.studio.drawing import drawing_of
from safenav.studio.editor import blank
from safenav.world.poses import Mobility

DOOR = (SCENARIOS / "case_study_1.yaml").read_text()
SEQUENCES = int(os.environ.get("SAFENAV_FUZZ", "0")) // 25 or 6
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))


TABLE = from_yaml(beside(__file__, "edits.yaml"))
COMMENTED = TABLE["texts"]["commented"]
TEXTS = {
    "door": DOOR,
    "commented": COMMENTED,
    "listed": COMMENTED.replace(
        "patrol: [12, 15]  # in turn",
        "patrol:\n      - 12  # the bed\n      - 15  # the hall",
    ),
    "areas": DOOR.replace(
        "robots:",
        "areas: {hall: {rows: 1-2, columns: 3}, spots: [[1, 1], {columns: 1-2}]}\nrobots:",
    ).replace("[54, 49]", "[hall, spots]"),
    "timed": DOOR.replace("{patrol: [58, 28]}", "{patrol: [58, 28], within: 40}")
    + "chargers: [14]\nlate: go_on\nresolve_within: 30\n",
}
SMALL = 'safenav: 1\nmap:\n  grid: ["###", \'#.#\', "###"]\n'


@pytest.mark.parametrize("case", TABLE["edits"], ids=str)
def test_an_edit_changes_only_its_lines(case: dict[str, Any]) -> None:
    """Comments, quotes and spaces of all others stay; an impossible edit is refused."""
    text = TEXTS.get(case["text"], SMALL + case["text"])
    try:
        after = edited(text, case["edit"])
    except UsageError as refused:
        assert str(refused) == case.get("refused")
        return
    told = [*difflib.unified_diff(text.splitlines(), after.splitlines(), n=0, lineterm="")][2:]
    assert [line for line in told if line[0] != "@"] == case["lines"].splitlines()


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


def edited(text: str, operation: dict[str, Any]) -> str:
    return editing.edited(text, operation, load_draft(text, "scenario.yaml").world)


def something(text: str, chance: random.Random) -> dict[str, Any]:
    """An edit, sensible or not."""
    draft = load_draft(text, "scenario.yaml")
    drawing = draft.world and drawing_of(text, draft.world, draft.catalogue)
    assert drawing, "a drawing never loses its map"
    size = drawing["run"]["rows"] * drawing["run"]["cols"]
    regions = [chance.randrange(size) for _ in range(2)]
    robot = chance.choice([each["name"] for each in drawing["robots"]] or ["nobody"])
    obstacle = {"index": chance.randrange(len(drawing["obstacles"]) + 1)}
    kind = chance.choice(("patrol", "visit", "cover", "hold"))
    edits: list[tuple[str, dict[str, Any]]] = [
        ("paint", {"regions": regions, "wall": chance.random() < 0.4}),
        ("add_robot", {"model": "digit", "heading": "east"}),
        ("add_robot", {"model": "quadcopter"}),
        ("move_robot", {"robot": robot}),
        ("set_heading", {"robot": robot, "heading": "west"}),
        ("set_objective", {"robot": robot, "kind": kind, "regions": regions}),
        ("set_objective", {"robot": robot, "kind": kind, "regions": ["a1", regions]}),
        ("remove_robot", {"robot": robot}),
        ("add_obstacle", {"type": "door"}),
        ("add_obstacle", {"type": "uncertainty", "from": 3}),
        ("move_obstacle", obstacle),
        ("remove_obstacle", obstacle),
    ]
    op, more = chance.choice(edits)
    return {"op": op, "region": chance.randrange(size), **more}


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


def test_areas_are_drawn_as_targets() -> None:
    text = TEXTS["areas"]
    draft = load_draft(text, "door.yaml")
    assert draft.world is not None
    drawing = drawing_of(text, draft.world, draft.catalogue)
    assert drawing is not None
    assert drawing["robots"][0]["targets"][0] == [16, 29]
    assert drawing["run"]["areas"]["hall"] == [16, 29]
