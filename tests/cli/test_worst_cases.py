"""What ``safenav check`` says of the times of resolutions."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cli.conftest import Command
from once import SCENARIOS
from runtime.played import loaded, play
from safenav.report.terminal.worst_cases import worst_lines
from safenav.runtime.deadlines.worst import Times, Worst, worst_cases
from safenav.world.moves import Pose

Alone = Callable[[str], dict[str, Any]]


@pytest.fixture
def alone(safenav: Command, tmp_path: Path) -> Alone:
    """The times of a scenario's only obstacle by ``check``, without other robots in the way."""

    def check(text: str) -> dict[str, Any]:
        (tmp_path / "s.yaml").write_text(text)
        (case,) = json.loads(safenav("check", "s.yaml", "--json").stdout)["obstacles"]
        return dict(case["alone"])

    return check


def test_case_study_3_can_lock_itself(safenav: Command) -> None:
    found = safenav("check", SCENARIOS / "case_study_3.yaml", "--json")
    cases = {case["obstacle"]: case for case in json.loads(found.stdout)["obstacles"]}
    unclear = cases["uncertainty@43"]
    assert (unclear["alone"]["best"], unclear["alone"]["worst"]) == (4, 8)
    assert unclear["with_others"]["worst"] is None
    assert unclear["with_others"]["moment"]["digit"][0] == 42
    assert all(
        case[around]["all_moments"]
        for case in cases.values()
        for around in ("alone", "with_others")
    )


def test_a_limit_that_cannot_always_be_kept_is_reported(safenav: Command, tmp_path: Path) -> None:
    text = (SCENARIOS / "case_study_1.yaml").read_text()
    (tmp_path / "tight.yaml").write_text(text + "resolve_within: 5\n")
    said = safenav("check", tmp_path / "tight.yaml").stdout
    assert "door@47: at best 1, at worst 8 ticks after its request" in said
    assert "resolve_within 5: not with quad at 46, digit at 28 facing west needs 9 ticks" in said


@pytest.mark.parametrize("later", [False, True], ids=["helper first", "helper later"])
def test_the_way_of_a_helper_and_the_time_of_a_resolution_are_those_of_the_run(
    later: bool, safenav: Command, alone: Alone
) -> None:
    """A helper whose turn comes later moves in the tick of the request already."""
    robots = {
        "quad": {"model": "quadcopter", "start": [1, 1], "objective": {"visit": [[1, 5], [1, 1]]}},
        "spot": {"model": "spot", "start": [1, 6], "objective": {"hold": [1, 6]}},
    }
    scenario = {
        "safenav": 1,
        "map": {"grid": ["########", "#......#", "########"]},
        "robots": dict(sorted(robots.items(), reverse=not later)),
        "obstacles": [{"type": "door", "region": [1, 4]}],
        "until": {"rounds": 1},
    }
    times, run = alone(json.dumps(scenario)), play(scenario)
    request, resolved = run.one("request"), run.one("resolved")
    assert times["bids"] == request["bids"] == {"spot": 2}
    assert times["worst"] == resolved["tick"] - request["tick"] == (1 if later else 2)
    said = "at worst 1 tick" if later else "at worst 2 ticks"
    told = f"{said} after its request (quad at 11, spot at 14 needs 2 ticks)"
    assert told in safenav("check", "s.yaml").stdout


@pytest.mark.parametrize(
    ("best", "worst", "whole", "said"),
    [
        (1, 8, True, "at best 1, at worst 8 ticks after its request"),
        (1, 8, False, "at best 1 or fewer, at worst 8 or more ticks after its request"),
        (0, 8, False, "at best 0, at worst 8 or more ticks after its request"),
        (None, None, True, "never resolved"),
        (None, None, False, "at worst never"),
    ],
)
def test_times_that_were_not_all_compared_are_reported_as_bounds(
    best: int | None, worst: int | None, whole: bool, said: str
) -> None:
    obstacle = loaded(NEEDS.replace("LIMIT", "")).obstacles[0]
    case = Worst(obstacle, None, Times(best, worst, {}, {}, whole), None)
    assert list(worst_lines([case], str)) == [f"{obstacle.name}: {said} ()"]


@pytest.mark.parametrize(
    ("alone", "around", "whole", "lines"),
    [
        (11, 1, False, 1),
        (11, 12, False, 2),
        (11, 9, True, 2),
        (11, None, False, 2),
        (3, 3, True, 1),
    ],
)
def test_a_lower_bound_beside_others_is_shown_where_it_exceeds_the_time_without_them(
    alone: int, around: int | None, whole: bool, lines: int
) -> None:
    obstacle = loaded(NEEDS.replace("LIMIT", "")).obstacles[0]
    times = (Times(0, alone, {}, {}, True), Times(0, around, {}, {}, whole))
    assert len(list(worst_lines([Worst(obstacle, None, *times)], str))) == lines


def test_only_the_nearest_of_many_helpers_are_named() -> None:
    obstacle = loaded(NEEDS.replace("LIMIT", "")).obstacles[0]
    bids = {"a": 9, "b": None, "d": 2, "e": 5, "f": 7}
    moment = {name: Pose(k, None) for k, name in enumerate(["c", *bids])}
    times = Times(1, 8, moment, bids, True)
    (line,) = worst_lines([Worst(obstacle, None, times, None)], str)
    assert line.endswith(
        "(c at 0, d at 3 needs 2 ticks, e at 4 needs 5 ticks, f at 5 needs 7 ticks, "
        "2 robots farther away)"
    )


NEEDS = """
safenav: 1
map: {grid: ["############", "#..........#", "############"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: []}
    lifter: {mobility: free, layer: air, capabilities: [lift]}
    crawler: {mobility: free, layer: rail, capabilities: [SKILLS]}
  obstacles:
    crate: {needs: [{action: lift, at: [[1, 4]]}, {action: sense, at: [[1, 6]]}], blocks: [ground]}
robots:
  c: {model: cart, start: [1, 2], objective: {visit: [[1, 7], [1, 2]]}}
  a: {model: lifter, start: [1, 1], objective: {hold: [1, 1]}}
  b: {model: crawler, start: [1, 10], objective: {hold: [1, 10]}}
obstacles: [{type: crate, region: [1, 5]LIMIT}]
until: {rounds: 1}
"""


@pytest.mark.parametrize(
    ("skills", "limit", "ticks"),
    [("sense", "", 5), ("sense", ", resolve_within: 9", 3), ("sense, lift", "", 5)],
    ids=["in turn", "the second robot sets out early", "one robot can do both"],
)
def test_the_robot_of_a_later_need_is_counted_from_when_it_sets_out(
    skills: str, limit: str, ticks: int, alone: Alone
) -> None:
    text = NEEDS.replace("SKILLS", skills).replace("LIMIT", limit)
    run, times = play(text), alone(text)
    assert run.one("resolved")["tick"] - run.all("request")[0]["tick"] == ticks
    assert (times["best"], times["worst"]) == (ticks, ticks)


FAR = """
safenav: 1
map: {{grid: [".......", "......."]}}
catalogue: {{robots: {{cart: {{mobility: free, layer: ground{battery}}}}}}}
robots: {{c: {{model: cart, start: 0, objective: {{visit: [6, 0]{within}}}}}}}
until: {{rounds: 2{by}}}
{chargers}
"""


@pytest.mark.parametrize(
    ("battery", "within", "by", "chargers", "why"),
    [
        (", battery: {capacity: 11, charge: 4}", "", "", "chargers: [0]", "reaches no other stop"),
        ("", ", within: 11", "", "", "the fastest round takes 12"),
        ("", "", ", by: 23", "", "cannot be completed before tick 24"),
    ],
    ids=["charge", "within", "by"],
)
def test_check_and_explain_refuse_deadlines_and_batteries_as_run_does(
    battery: str, within: str, by: str, chargers: str, why: str, safenav: Command, tmp_path: Path
) -> None:
    text = FAR.format(battery=battery, within=within, by=by, chargers=chargers)
    (tmp_path / "s.yaml").write_text(text)
    for name in ("run", "check", "explain"):
        done = safenav(name, "s.yaml")
        assert done.returncode == 1, (name, done.stdout)
        assert "unrealizable: " in done.stdout
        assert why in done.stdout
        apart = " realizable apart from deadlines and batteries, " in done.stdout
        assert apart is (name == "check")


def test_a_robot_that_starts_in_an_avoided_region_is_bad_input(
    safenav: Command, tmp_path: Path
) -> None:
    text = FAR.format(battery="", within=", avoid: [0]", by="", chargers="")
    (tmp_path / "s.yaml").write_text(text.replace("visit: [6, 0]", "visit: [6, 1]"))
    for name in ("check", "explain"):
        done = safenav(name, "s.yaml")
        assert (done.returncode, done.stdout) == (2, "")
        assert "it starts in 0 [0, 0], which it must avoid" in done.stderr


HELPER_WITH_RULES = """
safenav: 1
map: {grid: ["########", "#......#", "#.####.#", "#......#", "########"]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: []}
    drone: {mobility: free, layer: air, capabilities: [press]}
  obstacles: {gate: {action: press, resolve_at: [9], blocks: [ground]}}
robots:
  a: {model: cart, start: 12, objective: {visit: [9, 12]}}
  b: {model: drone, start: 13, objective: {hold: 13RULE}}
obstacles: [{type: gate, region: 10}]
"""


@pytest.mark.parametrize(
    ("rule", "ticks"),
    [
        ("", 3),
        (", avoid: [12]", 9),
        (', always: "region = 13 -> region\' != 12"', 9),
    ],
    ids=["free", "avoid", "always"],
)
def test_helpers_keep_the_rules_of_their_objectives_on_the_way(
    rule: str, ticks: int, alone: Alone
) -> None:
    times = alone(HELPER_WITH_RULES.replace("RULE", rule))
    assert (times["best"], times["worst"]) == (ticks, ticks)


ROOM = """
safenav: 1
map:
  grid: ["###########", "#...#..#..#", "#.....##..#", "#.........#", "#.#.#..#..#", "###########"]
catalogue:
  robots:
    cart: {mobility: free, layer: ground, capabilities: []}
    walk: {mobility: heading, layer: legs, capabilities: [press]}
    fly: {mobility: free, layer: air, capabilities: [sense, press], timing: FLY}
  obstacles:
    vault: {needs: [{action: sense, at: neighbours}, {action: press, at: [20]}], blocks: [ground]}
    fog: {action: sense, resolve_at: neighbours, blocks: [ground], has_truth: true}
robots:
  c: {model: cart, start: 47, objective: {visit: [47, 53]}}
  w: {model: walk, start: 35, heading: south, objective: {visit: [35, 36]}}
  f: {model: fly, start: PLACE, objective: {visit: [PLACE, 20]}}
obstacles: [{type: KIND, region: 40LIMIT}]
suspects: [{type: KIND, region: 40}]
until: {rounds: 1}
"""


@pytest.mark.parametrize("fly", ["1", "2", "{least: 1, most: 3}"])
@pytest.mark.parametrize("place", ["42", "12"])
@pytest.mark.parametrize("kind", ["fog", "vault"])
def test_runs_take_at_least_the_best_and_at_most_the_worst_time(
    kind: str, place: str, fly: str, alone: Alone
) -> None:
    """A robot alone has both needs; it passes; its steps take long."""
    text = ROOM.replace("KIND", kind).replace("PLACE", place).replace("FLY", fly)
    run, times = play(text.replace("LIMIT", "")), alone(text.replace("LIMIT", ""))
    took = run.one("resolved")["tick"] - run.all("request")[0]["tick"]
    assert times["best"] <= took <= times["worst"]


def test_a_deadline_is_judged_where_the_obstacle_is_also_a_suspect(
    safenav: Command, tmp_path: Path
) -> None:
    text = ROOM.replace("KIND", "fog").replace("PLACE", "12").replace("FLY", "1")
    (tmp_path / "s.yaml").write_text(text.replace("LIMIT", ", resolve_within: 3"))
    assert "resolve_within 3: not with c at 39" in safenav("check", "s.yaml").stdout


def test_helpers_too_many_for_all_moments_are_compared_where_they_are_far() -> None:
    """The others were where their strategies list them last: here beside the door."""
    carts = "".join(
        f"  c{n}: {{model: spot, start: [{n}, 1], objective: {{hold: [{n}, 1]}}}}\n"
        for n in range(1, 5)
    )
    scenario = loaded(
        "map: {grid: ['############', '#..........#', '#.......####', '#.......####',"
        " '#.......####', '############']}\n"
        "obstacles: [{type: door, region: [1, 9]}]\n"
        "robots:\n"
        "  quad: {model: quadcopter, start: [1, 10], objective: {hold: [1, 10]}}\n" + carts
    )
    region = scenario.map.region
    poses = {f"c{n}": [Pose(region(n, c)) for c in range(1, 8)] for n in range(1, 5)}
    (case,) = worst_cases(scenario, {"quad": [Pose(region(1, 10))], **poses})
    assert not case.alone.whole
    assert case.alone.worst is not None and case.alone.worst >= 7
