"""Findings of long campaigns: honest runs that were refused, and forged lines that were
accepted."""

from pathlib import Path

import pytest

from certify.making import bundle_at, files_of, judged, rewrite
from certify.mutants import lines_of, with_lines
from runtime.played import Run

LANE = '["#####", "#...#", "#####"]'
BAY = '["#####", "#...#", "##.##", "#####"]'
EXACT = (
    LANE,
    """
  a: {model: cart, tracking: exact, start: 6, objective: {visit: [6, 7]}}
  b: {model: cart, tracking: exact, start: 8, objective: {hold: 8}}
""",
)
TWO_NEEDS = (
    BAY,
    """
  a: {model: cart, start: 6, objective: {visit: [8, 6]}}
  b: {model: lifter, start: 12, objective: {hold: 12}}
  c: {model: pusher, start: 8, objective: {hold: 8}}
obstacles: [{type: pile, region: 7}]
""",
)
HELD_BACK = (
    '["#######", "#.....#", "#.....#", "#######"]',
    """
  a: {model: walker, tracking: belief, vision: 3, start: 11, heading: west, objective: {hold: 15}}
  b: {model: walker, start: 18, heading: east, objective: {hold: 15}}
obstacles: [{type: door, region: 19}]
""",
)
LOSES_SIGHT = (
    '["######", "#....#", "#....#", "######"]',
    """
  a: {model: pusher, start: 15, objective: {visit: [7, 16]}}
  b: {model: cart, tracking: belief, vision: 1, start: 9, objective: {cover: [13, 15]}}
  c: {model: cart, tracking: belief, vision: 2, start: 7, objective: {visit: [10]}}
obstacles: [{type: bar, region: 8}]
coordination: assignable
""",
)
FROM_BOTH_SIDES = (
    '["#######", "#.....#", "#######"]',
    """
  a: {model: cart, avoids: [], start: 8, objective: {visit: [11, 8]}}
  b: {model: cart, avoids: [], start: 12, objective: {visit: [9, 12]}}
  c: {model: pusher, start: 8, objective: {hold: 8}}
obstacles: [{type: bar, region: 10}]
""",
)
ON_ITS_TARGET = (
    '["#######", "####..#", "#.##..#", "#.....#", "#######"]',
    """
  a: {model: cart, start: 18, objective: {patrol: [19, 11]}}
obstacles: [{type: uncertainty, region: 12}]
until: {rounds: 2}
""",
)
TOLD_ON_ITS_WAY = (
    '["#####", "#..##", "###.#", "#...#", "#...#", "#####"]',
    """
  a: {model: quadcopter, start: 17, objective: {visit: [18, 22]}}
  b: {model: barge, start: 22, objective: {hold: 18}}
obstacles: [{type: uncertainty, region: 13, traversable: false}]
until: {rounds: 1}
coordination: assignable
""",
)
COMES_BACK = (
    '["#######", "#.....#", "#######"]',
    """
  a: {model: pusher, start: 8, objective: {hold: 8}}
  b: {model: cart, start: 12, objective: {visit: [12, 9]}}
obstacles:
  - {type: bar, region: 10, until: 12}
  - {type: bar, region: 10, from: 13}
until: {rounds: 3}
""",
)
CATALOGUE = """
  robots:
    cart: {mobility: free, layer: ground, capabilities: []}
    walker: {mobility: heading, layer: ground, capabilities: []}
    barge: {mobility: free, layer: ground, capabilities: [], timing: 2}
    lifter: {mobility: free, layer: ground, capabilities: [lift]}
    pusher: {mobility: free, layer: air, capabilities: [push]}
  obstacles:
    bar: {action: push, resolve_at: neighbours, blocks: [ground]}
    pile:
      needs: [{action: lift, at: neighbours}, {action: push, at: neighbours}]
      blocks: [ground]
"""


def bundle_of(mission: tuple[str, str]) -> Path:
    grid, robots = mission
    start = f"safenav: 1\nmap: {{grid: {grid}}}\nlimits: {{ticks: 60}}\ncatalogue:{CATALOGUE}"
    return bundle_at("finding", f"{start}robots:\n  {robots.strip()}\n")


def run_of(mission: tuple[str, str]) -> Run:
    """The run of a mission, whose bundle is accepted."""
    return Run(lines_of(files_of(bundle_of(mission))))


def said_of(mission: tuple[str, str], run: Run, target: Path) -> str:
    """The last line of what the checker says of the mission's bundle with another run."""
    bundle = bundle_of(mission)
    files = with_lines(files_of(bundle), run.records)
    return judged(rewrite(bundle, files, target / "bundle"))[1].splitlines()[-1]


def test_a_helper_may_be_sent_to_some_of_the_places_where_it_can_help() -> None:
    """b stands on one of them, and waits there on its own account."""
    run = run_of(TWO_NEEDS)
    assert run.all("request")[0]["regions"] == [6, 8, 12]
    assert run.all("push")[0]["objectives"]["b"] == {"visit": [12, 12]}


@pytest.mark.parametrize("name", ["a", "b"])
def test_a_wrong_start_of_another_robot_is_refused(name: str, tmp_path: Path) -> None:
    """One step away from there is another mission."""
    run = run_of(EXACT)
    known = run.all("synthesis", robot=name)[0]["knowledge"]
    ((other, region),) = known.items()
    known[other] = 7
    assert region in (6, 8)
    said = said_of(EXACT, run, tmp_path)
    assert f"{name} believes {other} to be where it is not" in said


def test_a_helper_must_be_able_to_fulfil_the_next_need(tmp_path: Path) -> None:
    """The other one can do something about the obstacle, but not yet."""
    run = run_of(TWO_NEEDS)
    assert run.all("push")[0]["helper"] == "b"
    for line in (*run.all("push", helper="b"), *run.all("pop", helper="b")):
        line |= {"helper": "c"} | ({"helpers": ["c"]} if "helpers" in line else {})
    said = said_of(TWO_NEEDS, run, tmp_path)
    assert "c helps with pile@7, but lacks the action" in said


def test_a_move_records_that_its_strategy_was_shown_busy_regions() -> None:
    """The move says what its strategy was shown: that somebody is where it must not go."""
    shown = [line for line in run_of(HELD_BACK).records if line.get("busy")]
    assert shown
    assert all(line["by"] == "strategy" for line in shown)
    assert any(line["to"] != line["from"] for line in shown)


def test_a_strategy_of_assignable_goals_is_always_about_its_own() -> None:
    """Two get new ones while they wait, since they see the obstacle; their commands stay."""
    run = run_of(LOSES_SIGHT)
    own = {name: r["objective"] for name, r in run.records[0]["scenario"]["robots"].items()}
    push = run.all("push")[0]
    again = Run(run.records[run.records.index(push) :]).all("synthesis")
    assert again
    assert push["objectives"][again[0]["robot"]] != own[again[0]["robot"]]
    assert all(line["objective"] == own[line["robot"]] for line in again)


def test_an_obstacle_comes_back_under_its_name(tmp_path: Path) -> None:
    """It was refused as a second one, and for want of a request from before it came back."""
    run = run_of(COMES_BACK)
    assert len(run.all("resolved")) == 2
    run.records[0]["scenario"]["obstacles"][1]["blocks"] = []
    assert "differs when it reappears" in said_of(COMES_BACK, run, tmp_path)


def test_a_robot_that_encounters_an_obstacle_requests_help(tmp_path: Path) -> None:
    """Even if another one has asked already: it is told what to do until the obstacle is gone."""
    run = run_of(FROM_BOTH_SIDES)
    run.records.remove(run.all("push", requester="b")[0])
    said = said_of(FROM_BOTH_SIDES, run, tmp_path)
    assert "b waits for bar@10, but no push follows" in said


@pytest.mark.parametrize("name", ["robots.b", "b", "any robot"])
def test_no_obstacle_has_the_name_of_a_robot(name: str, tmp_path: Path) -> None:
    """Who knows of the one would seem to know of the other, and what is never resolved would seem
    to be somebody who is stuck."""
    said = discovering(tmp_path, name=name)
    assert "an obstacle has the name of a robot" in said


def test_an_obstacle_that_there_is_cannot_be_discovered(tmp_path: Path) -> None:
    """It could stand elsewhere from then on, for others, or need less."""
    assert discovering(tmp_path, region=12).endswith("'pile@7' is discovered, but is known already")


def discovering(target: Path, **other: object) -> str:
    """What the checker says of a run that discovers its obstacle again, as another one."""
    run = run_of(TWO_NEEDS)
    obstacle = run.records[0]["scenario"]["obstacles"][0] | other
    run.records.insert(1, {"type": "discovered", "tick": 0, "obstacle": obstacle})
    return said_of(TWO_NEEDS, run, target)


def test_a_robot_in_transit_records_its_new_command_on_arrival() -> None:
    """Between two regions it gets another strategy, with other inputs for the wait."""
    told = [line for line in run_of(TOLD_ON_ITS_WAY).all("move", robot="b") if "signal" in line]
    signals = [("by" in line, line["signal"]["assigned"]) for line in told]
    assert signals == [(True, 13), (False, 16)]


def test_a_round_continues_where_a_new_strategy_begins_on_a_target(tmp_path: Path) -> None:
    """And a target that is never met is not made up for by the other one."""
    run = run_of(ON_ITS_TARGET)
    again = run.all("synthesis")[1]
    assert (again["region"], again["memory"]) == (19, {"scout": 0})
    assert run.outcome["outcome"] == "completed"
    fewer = Run([line for line in run.records if line.get("goal") != 1])
    assert said_of(ON_ITS_TARGET, fewer, tmp_path).endswith(
        "a reaches its target 11 (1, 4), but the goal line is missing"
    )
