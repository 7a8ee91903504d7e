"""Valid scenarios: the loader's result for each item of the format; areas wherever a target can
stand; obstacles that need several actions or robots, and that come and go."""

import re
from pathlib import Path

import pytest

from safenav.errors import InputError
from safenav.scenario.model import Need, ResolveAt, Scenario
from safenav.scenario.objective import Hold, Ltl, Objective, Patrol, Visit, describe, written
from safenav.scenario.reading.loader import load_scenario, load_scenario_text

ROOMS = """\
safenav: 1
map:
  grid: |
    #######
    #..#..#
    #.....#
    #..#..#
    #######
  names: {dock: [1, 2], gate: 17}
"""
AREAS = """\
areas:
  west: {rows: 1-3, columns: 0-2}
  east: [{columns: 4-6}]
  corner: [[3, 4], 26]
"""
WEST, EAST, CORNER = {8, 9, 15, 16, 22, 23}, {11, 12, 18, 19, 25, 26}, {25, 26}


def ann(objective: str, robot: str = "model: quadcopter, start: 8", rest: str = AREAS) -> Scenario:
    robots = f"robots:\n  ann: {{{robot}, objective: {objective}}}\n"
    return load_scenario_text(ROOMS + rest + robots, "rooms.yaml")


def test_raw_guarantees_are_kept_in_canonical_form() -> None:
    """Also if areas are named like headings."""
    scenario = ann(
        """{ltl: {memory: {done: bool, laps: [0, 3]},
        init: "!done /\\\\ laps = 0",
        safety: ["done' <--> (done || region=dock)", 'heading = north -> !X((heading = west))'],
        liveness: [region = gate]}}""",
        "model: digit, start: 8, heading: east",
    )
    assert scenario.robots[0].objective == Ltl(
        init=("!done & laps = 0",),
        safety=("done' <-> done | region = 9", "heading = 0 -> !next(heading = 3)"),
        liveness=("region = 17",),
        memory={"done": None, "laps": (0, 3)},
    )


def test_a_target_may_be_out_of_reach_if_another_of_its_set_is_not() -> None:
    text = "safenav: 1\nmap: {grid: ['.#.']}\n"
    robots = "robots: {ann: {model: quadcopter, start: 0, objective: {hold: {any: [0, 2]}}}}"
    assert load_scenario_text(text + robots).robots[0].objective == Hold((frozenset({0, 2}),))


def test_a_key_of_another_tool_is_reported_with_the_key_of_scenarios() -> None:
    """Nor is the key that was meant reported as missing."""
    text = "safenav: 1\nmap: {grid: ['..'], regions: {a: 1}}\n"
    robots = "robots: {ann: {type: quadcopter, position: 0, goal: {hold: 0}}}"
    with pytest.raises(InputError) as raised:
        load_scenario_text(text + robots)
    meant = [re.findall("did you mean '(.*?)'", d.hint or "") for d in raised.value.diagnostics]
    assert meant == [["names"], ["model"], ["start"], ["objective"]]


def test_line_ends_and_byte_order_marks_of_other_systems(tmp_path: Path) -> None:
    body = ROOMS + "robots: {ann: {model: quadcopter, start: 8, objective: {hold: 9}}}\n"
    file = tmp_path / "with space and ü.yaml"
    file.write_bytes(b"\xef\xbb\xbf" + body.replace("\n", "\r\n").encode())
    assert load_scenario(file).map == load_scenario_text(body).map


def test_a_map_that_is_too_large() -> None:
    rows = "".join(f"    {'.' * 600}\n" for _ in range(500))
    robots = "robots: {ann: {model: quadcopter, start: 0, objective: {hold: 1}}}"
    with pytest.raises(InputError, match="a map of 500 x 600 regions; the maximum is 262144"):
        load_scenario_text(f"safenav: 1\nmap:\n  grid: |\n{rows}{robots}")


def test_rectangles_hold_their_free_regions_and_lists_the_named_ones() -> None:
    assert ann("{hold: 8}").map.areas == {"west": WEST, "east": EAST, "corner": CORNER}


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
    told: str, expected: Objective, words: str
) -> None:
    scenario = ann(told)
    objective = scenario.robots[0].objective
    assert objective == expected
    assert words in describe(objective, scenario.map.word)
    assert ann(written(objective, scenario.map.word)).robots[0].objective == objective


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


TEAM = """\
safenav: 1
map: {grid: ["#######", "#.....#", "#.....#", "#######"]}
robots:
  a: {model: digit, start: [1, 1], heading: east, objective: {hold: [1, 1]}}
  b: {model: digit, start: [1, 3], heading: east, objective: {hold: [1, 3]}}
  q: {model: quadcopter, start: [2, 1], objective: {hold: [2, 1]}}
catalogue:
  obstacles:
    vault: {needs: NEEDS}
obstacles: OBSTACLES
"""
VAULT, PUSH = "[{type: vault, region: [1, 4]}]", "[{action: push}]"
AFTER = "[{type: vault, region: [1, 4], until: 9}, {type: door, region: [1, 4], from: 9}]"


def with_needs(needs: str, obstacles: str = VAULT) -> Scenario:
    return load_scenario_text(TEAM.replace("NEEDS", needs).replace("OBSTACLES", obstacles))


def test_needs_are_read_in_their_order() -> None:
    scenario = with_needs(
        "[{action: sense, at: neighbours}, {action: push, robots: 2, together: true}]"
    )
    assert scenario.obstacles[0].needs == (
        Need("sense", 1, ResolveAt.NEIGHBOURS),
        Need("push", 2, ResolveAt.SELF, together=True),
    )


@pytest.mark.parametrize(
    ("needs", "blocks", "closed"),
    [
        ("[{action: push}]", "", ({"q"}, None)),
        ("[{action: push, at: neighbours}]", "", ({"a", "b", "q"}, None)),
        ("[{action: push, at: [[1, 1]]}]", "", ({"a", "b", "q"}, None)),
        ("[{action: push, at: [[1, 4], [1, 1]]}]", "", ({"q"}, None)),
        ("[{action: push, robots: 2}]", "", ({"a", "b", "q"}, None)),
        ("[{action: sense, at: neighbours}, {action: push}]", "", ({"a", "b", "q"}, {"q"})),
        ("[{action: push}, {action: push}]", "", ({"a", "b", "q"}, {"q"})),
        ("[{action: push}, {action: sense}]", "", ({"a", "b", "q"}, {"a", "b"})),
        ("[{action: push, at: neighbours}]", "blocks: [ground]", ({"a", "b"}, None)),
        ("[{action: push, at: neighbours}]", "blocks: [quadcopter]", ({"q"}, None)),
        ("[{action: push, at: neighbours}]", "blocks: [b, q]", ({"b", "q"}, None)),
        ("[{action: push, at: neighbours}]", "blocks: []", (set(), None)),
        ("[{action: push}]", "blocks: [a]", (set(), None)),
    ],
)
def test_robots_keep_out_unless_they_resolve_by_entering(
    needs: str, blocks: str, closed: tuple[set[str], set[str] | None]
) -> None:
    """The robots to which the obstacle is closed while all needs are left, and while the last is:
    those that it physically stops, unless entering meets the only need that is left."""
    scenario = with_needs(f"{needs}{', ' + blocks if blocks else ''}")
    vault = scenario.obstacles[0]
    for need, names in enumerate(closed):
        if names is not None:
            assert {r.name for r in scenario.robots if vault.closed_to(r, need)} == names


@pytest.mark.parametrize(
    ("needs", "obstacles", "found"),
    [
        ("[{action: push}], action: push", VAULT, "both 'needs' and 'action'"),
        (PUSH, VAULT.replace("}", ", from: 9, until: 9}"), "disappears before it appears"),
        (PUSH, AFTER.replace("from: 9", "from: 8"), "the region already contains"),
    ],
)
def test_impossible_needs_are_refused(needs: str, obstacles: str, found: str) -> None:
    with pytest.raises(InputError, match=found):
        with_needs(needs, obstacles)


def test_a_region_may_hold_one_obstacle_after_the_other() -> None:
    assert [o.appears for o in with_needs(PUSH, AFTER).obstacles] == [None, 9]
