"""Areas: named sets of regions wherever a target or a set of regions can stand."""

import pytest

from safenav.errors import InputError
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Hold, Patrol, Visit, describe, written
from safenav.scenario.reading.loader import load_scenario_text
from scenario.rooms import ROOMS
from scenario.rooms import load as load_rooms

AREAS = """\
areas:
  west: {rows: 1-3, columns: 0-2}
  east: [{columns: 4-6}]
  corner: [[3, 4], 26]
"""
WEST, EAST, CORNER = {8, 9, 15, 16, 22, 23}, {11, 12, 18, 19, 25, 26}, {25, 26}


def load(rest: str) -> Scenario:
    return load_rooms(AREAS + rest)


def robot(objective: str) -> Scenario:
    start = "model: quadcopter, start: 8"
    return load(f"robots:\n  ann: {{{start}, objective: {objective}}}\n")


def test_rectangles_hold_their_free_regions_and_lists_the_named_ones() -> None:
    assert robot("{hold: 8}").map.areas == {"west": WEST, "east": EAST, "corner": CORNER}


@pytest.mark.parametrize(
    ("told", "expected", "words"),
    [
        ("{patrol: [west, gate]}", Patrol((frozenset(WEST), frozenset({17}))), "west <-> gate"),
        ("{hold: east}", Hold((frozenset(EAST),)), "hold east"),
        (
            "{hold: east, always: [region != 9, region != 17]}",
            Hold((frozenset(EAST),), always=("region != 9", "region != 17")),
            "hold east, always region != 9, always region != 17",
        ),
        (
            "{hold: east, always: [region != 9, region != 17, region != 18]}",
            Hold((frozenset(EAST),), always=("region != 9", "region != 17", "region != 18")),
            "hold east, always its 3 formulas",
        ),
        (
            "{visit: [{any: [corner, dock]}, west]}",
            Visit((frozenset(CORNER | {9}), frozenset(WEST))),
            "visit corner|dock, west in turn",
        ),
    ],
)
def test_objectives_take_areas_and_are_described_by_their_names(
    told: str, expected: object, words: str
) -> None:
    scenario = robot(told)
    objective = scenario.robots[0].objective
    assert objective == expected
    assert words in describe(objective, scenario.map.word)
    assert robot(written(objective, scenario.map.word)).robots[0].objective == objective


@pytest.mark.parametrize(
    ("areas", "told"),
    [
        ("{desk: [2, 3]}", "'desk': [2, 3] is two regions, and not both are free\n"),
        ("{desk: [8, {any: [9]}]}", "an area lists its regions: [[1, 1], [1, 2]]"),
    ],
)
def test_a_malformed_area_is_reported_with_the_intended_form(areas: str, told: str) -> None:
    text = ROOMS + f"areas: {areas}\n"
    with pytest.raises(InputError) as error:
        load_scenario_text(text + "robots: {}\n", "rooms.yaml")
    assert told.strip() in str(error.value)


@pytest.mark.parametrize(
    ("regions", "apart"), [("[11, 4]", True), ("[11, 12]", False), ("[11, 8]", False)]
)
def test_two_regions_apart_are_noted_where_they_may_be_one(regions: str, apart: bool) -> None:
    grid = "map: {resolution: 1, grid: [" + ", ".join(['"......"'] * 12) + "]}\n"
    robots = "robots: {ann: {model: quadcopter, start: 8, objective: {hold: desk}}}\n"
    text = f"safenav: 1\n{grid}areas: {{desk: {regions}}}\n{robots}"
    notes = load_scenario_text(text, "open.yaml").map.notes
    assert [("[[11, 4]]" in note) for note in notes] == [True] * apart
