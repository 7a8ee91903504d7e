"""Valid scenarios: the loader's result for each item of the format."""

import os
import re
from pathlib import Path

import pytest

from safenav.errors import InputError
from safenav.outcome import Outcome
from safenav.scenario.model import Robot, Scenario, Tracking
from safenav.scenario.objective import Cover, Hold, Ltl, Patrol, Visit
from safenav.scenario.objective_text import to_data, written
from safenav.scenario.reading.loader import load_scenario, load_scenario_text
from safenav.scenario.settings import Coordination, Limits, Until
from safenav.world.map import Heading
from safenav.world.moves import Pose
from scenario.rooms import ROOMS, load


def objective(told: str, robot: str = "model: quadcopter, start: 8") -> object:
    return load(f"robots:\n  ann: {{{robot}, objective: {told}}}\n").robots[0].objective


def test_everything_at_its_default() -> None:
    scenario = load("robots: {ann: {model: quadcopter, start: 8, objective: {hold: 9}}}")
    assert scenario.name == "rooms"
    assert scenario.map.grid_rows()[1] == "#..#..#"
    assert scenario.map.names == {"dock": 9, "gate": 17}
    assert scenario.obstacles == ()
    assert scenario.until == Until()
    assert scenario.limits == Limits()
    assert scenario.seed == 0
    assert scenario.coordination is Coordination.RESYNTHESIS
    assert scenario.expect.outcome is None


def test_everything_given() -> None:
    scenario = load("""\
name: all of it
robots:
  ann: {model: digit, start: dock, heading: south, objective: {patrol: [8, [3, 5]]}}
  fly: {model: quadcopter, start: 9, heading: east, objective: {hold: gate}}
obstacles:
  - {type: door, region: gate}
  - {type: uncertainty, region: [3, 1]}
  - {type: uncertainty, region: 23, traversable: false}
  - {type: uncertainty, region: 25, traversable: true}
until: {rounds: 3}
limits: {ticks: 50, synthesis_seconds: 2.5, synthesis_memory: 100}
seed: 7
coordination: assignable
expect:
  outcome: tick_limit
  resolved: [door@17, "uncertainty@[3, 1]", door@gate]
  blocked: [uncertainty@23]
  helpers: {door@gate: ann}
  ticks: 40
""")
    ann, fly = scenario.robots
    assert ann.start == Pose(9, Heading.SOUTH)
    assert ann.objective == Patrol((frozenset({8}), frozenset({26})))
    assert fly.start == Pose(9)
    names = ["door@17", *(f"uncertainty@{region}" for region in (22, 23, 25))]
    assert [o.name for o in scenario.obstacles] == names
    assert [o.traversable for o in scenario.obstacles] == [None, True, False, True]
    assert scenario.until == Until(3)
    assert scenario.limits == Limits(50, 2.5, 100)
    assert scenario.seed == 7
    assert scenario.coordination is Coordination.ASSIGNABLE
    assert scenario.expect.outcome is Outcome.TICK_LIMIT
    assert scenario.expect.resolved == frozenset({"door@17", "uncertainty@22"})
    assert scenario.expect.blocked == frozenset({"uncertainty@23"})
    assert scenario.expect.helpers == {"door@17": "ann"}
    assert scenario.expect.ticks == 40
    assert len({scenario, scenario}) == 1


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("{patrol: [8, 26]}", Patrol((frozenset({8}), frozenset({26})))),
        ("{patrol: [{any: [8, dock]}, gate]}", Patrol((frozenset({8, 9}), frozenset({17})))),
        ("{visit: [8, 9, 8]}", Visit((frozenset({8}), frozenset({9}), frozenset({8})))),
        ("{visit: [3, 8]}", None),
        ("{visit: [[1, 4], 8]}", Visit((frozenset({11}), frozenset({8})))),
        ("{cover: [dock]}", Cover((frozenset({9}),))),
        ("{hold: [3, 5]}", Hold((frozenset({26}),))),
        ("{hold: {any: [26, [1, 1]]}}", Hold((frozenset({26, 8}),))),
    ],
)
def test_objectives_with_regions(written: str, expected: object) -> None:
    if expected is None:  # a list of targets is no [row, column]: region 3 is a wall
        with pytest.raises(InputError, match=r"region 3 \[0, 3\] is a wall"):
            objective(written)
    else:
        assert objective(written) == expected


@pytest.mark.parametrize("written", ["visit: [3, 5]", "cover: [8, 3]", "visit: [1, 2]"])
def test_a_position_without_brackets_of_its_own(written: str) -> None:
    """Both are walls, or one is and the position is free; told once, and only where it helps."""
    with pytest.raises(InputError) as raised:
        objective(f"{{{written}}}")
    told = str(raised.value)
    assert told.count("rooms.yaml:") == 1
    pair = written.split(": ")[1]
    assert (f"did you mean [{pair}]?" in told) == (pair != "[8, 3]"), told


def test_raw_guarantees_are_kept_in_canonical_form() -> None:
    found = objective(
        """{ltl: {memory: {done: bool, laps: [0, 3]},
        init: "!done /\\\\ laps = 0",
        safety: ["done' <--> (done || region=dock)", 'heading = north -> !X((heading = west))'],
        liveness: [region = gate]}}""",
        "model: digit, start: 8, heading: east",
    )
    assert found == Ltl(
        init=("!done & laps = 0",),
        safety=("done' <-> done | region = 9", "heading = 0 -> !next(heading = 3)"),
        liveness=("region = 17",),
        memory={"done": None, "laps": (0, 3)},
    )


def test_objectives_of_a_trace_read_back() -> None:
    for told in (
        "{patrol: [8, 26]}",
        "{visit: [8, 9]}",
        "{cover: [8, 9, 26]}",
        "{hold: 8}",
        '{ltl: {safety: ["a\' -> a"], liveness: [a], memory: {a: bool, b: [1, 2]}}}',
    ):
        first = objective(told)
        assert isinstance(first, Patrol | Visit | Cover | Hold | Ltl)
        assert objective(str(to_data(first))) == objective(written(first)) == first


def test_formulas_about_inputs_are_written_as_they_are_read() -> None:
    text = "inputs: {alarm: {}}\nrobots: {ann: {model: quadcopter, start: 8, objective: %s}}\n"
    first = load(text % "{ltl: {liveness: [alarm & region = 9]}}").robots[0].objective
    assert load(text % written(first)).robots[0].objective == first


def team(first: str, second: str) -> tuple[Scenario, Robot, Robot]:
    scenario = load(f"""\
robots:
  ann: {{model: digit, start: 8, heading: east, objective: {{hold: 26}}, {first}}}
  bob: {{model: digit, start: 9, heading: east, objective: {{hold: 26}}, {second}}}
""")
    ann, bob = scenario.robots
    return scenario, ann, bob


def test_robots_have_the_avoids_and_tracks_of_the_file() -> None:
    _, ann, bob = team(
        "avoids: [bob], tracks: [bob], tracking: exact", "avoids: [], tracking: belief"
    )
    assert (ann.avoids, ann.tracks, ann.tracking) == (
        frozenset({"bob"}),
        frozenset({"bob"}),
        Tracking.EXACT,
    )
    assert (bob.avoids, bob.tracks, bob.tracking) == (frozenset(), frozenset(), Tracking.BELIEF)
    assert bob.conflicts(ann), "it is mutual although only ann asks for it"


def test_a_robot_may_have_another_vision_than_its_model() -> None:
    scenario = load("""\
robots:
  ann: {model: rover, start: 8, objective: {hold: 26}}
  bob: {model: rover, start: 9, objective: {hold: 26}, vision: 2.5}
  cat: {model: rover, start: 11, objective: {hold: 26}, vision: unlimited}
catalogue: {robots: {rover: {mobility: free, layer: rail, vision: 4}}}
""")
    assert [robot.model.vision for robot in scenario.robots] == [4.0, 2.5, None]
    assert {robot.model.name for robot in scenario.robots} == {"rover"}


FLYER = "robots: {ann: {model: quadcopter, start: 8, objective: {hold: 9}}}\n"


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("rooms", None),
        ("{tiles: [2, 4]}", [{8, 9}, {11, 12}, {15, 16, 17, 22, 23}, {18, 19, 25, 26}]),
    ],
)
def test_cells_of_beliefs(written: str, expected: list[set[int]] | None) -> None:
    found = load(FLYER + f"partition: {written}\n").partition
    if expected is None:
        assert found is None
    else:
        assert found is not None
        assert sorted(map(sorted, found)) == sorted(map(sorted, expected))


def test_empty_lines_around_the_grid_do_not_count() -> None:
    text = "safenav: 1\nmap:\n  grid: |\n\n    ..  \n    .x\n\n\n"
    robots = "robots: {ann: {model: quadcopter, start: 0, objective: {hold: 1}}}"
    with pytest.raises(InputError, match=r"<text>:6:6: row 1, column 1 of the map: 'x'"):
        load_scenario_text(text + robots)
    assert load_scenario_text((text + robots).replace("x", "#")).map.grid_rows() == ["..", ".#"]


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


def test_a_path_that_is_not_a_scenario_is_refused_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "door.yaml").write_text("")
    os.mkfifo(tmp_path / "pipe.yaml")
    expected = {
        "none/door.yaml": "no such file\n.*directory .* does not exist",
        "pipe.yaml": "not a regular file",
        "door.yaml/x": "not readable: Not a directory",
        "x\0y": "not readable: .*null",
        "x" * 5000: "not readable: File name too long",
    }
    for name, words in expected.items():
        with pytest.raises(InputError, match=words):
            load_scenario(tmp_path / name)


def test_a_file_that_may_not_be_read(tmp_path: Path) -> None:
    file = tmp_path / "secret.yaml"
    file.write_text(ROOMS)
    file.chmod(0)
    user = os.geteuid()
    if user == 0:  # the superuser may read everything
        os.seteuid(65534)
    try:
        with pytest.raises(InputError, match="permission denied"):
            load_scenario(file)
    finally:
        os.seteuid(user)


def test_a_map_that_is_too_large() -> None:
    rows = "".join(f"    {'.' * 600}\n" for _ in range(500))
    robots = "robots: {ann: {model: quadcopter, start: 0, objective: {hold: 1}}}"
    with pytest.raises(InputError, match="a map of 500 x 600 regions; the maximum is 262144"):
        load_scenario_text(f"safenav: 1\nmap:\n  grid: |\n{rows}{robots}")


def test_a_thousand_mistakes_are_not_all_listed() -> None:
    rows = "".join(f"    {'x' * 5}\n" for _ in range(1000))
    with pytest.raises(InputError) as caught:
        load_scenario_text(f"safenav: 1\nmap:\n  grid: |\n{rows}\nrobots: {{}}\n")
    assert len(caught.value.diagnostics) == 101
    assert caught.value.diagnostics[-1].found == "and 901 more"


MISSPELT = """
safenav: 1
map:
  grid: ["...", "..."]
  names: {home: 0, far: 5}
areas: {south: {rows: 1}}
inputs: {alarm: {at: 3}}
catalogue:
  robots: {cart: {mobility: heading, layer: ground, capabilities: [lift]}}
  obstacles: {crate: {needs: [{action: lift, at: neighbours}]}}
robots:
  ann:
    {model: cart, start: home, heading: east,
     objective: {visit: [south, far]}, when: {alarm: {hold: far}}}
obstacles: [{type: crate, region: 2}]
expect: {resolved: [crate@2], helpers: {crate@2: ann}}
"""


NAMES = {"home", "far", "south", "alarm", "cart", "crate", "ann"}


@pytest.mark.parametrize("key", sorted({*re.findall(r"([a-z]{3,}):", MISSPELT)} - NAMES))
def test_a_misspelt_key_causes_no_other_error(key: str) -> None:
    """A name that is declared misspelt is unknown where it is used."""
    text = re.sub(rf"\b{key}:", f"{key[:-1]}{key[-1] * 2}:", MISSPELT)
    assert len(text) > len(MISSPELT)
    with pytest.raises(InputError) as raised:
        load_scenario_text(text)
    places = [(found.line, found.found) for found in raised.value.diagnostics]
    written = text.count(f"{key}{key[-1]}:")
    assert len(places) == written, places


@pytest.mark.parametrize(
    ("due", "hint"),
    [
        ("until: {by: 9}", r"end the run by 'limits: \{seconds: 60\}'"),
        ("obstacles: [{type: door, region: 8, resolve_within: 9}]", "requested_door@8"),
    ],
)
def test_live_deadlines_in_ticks_are_refused_with_the_alternative(due: str, hint: str) -> None:
    with pytest.raises(InputError, match=hint):
        load_scenario_text(
            "safenav: 1\nclock: live\nmap: {grid: ['#####', '#...#', '#####']}\n"
            "robots: {d: {model: spot, start: 6, objective: {hold: 6}}}\n" + due
        )
