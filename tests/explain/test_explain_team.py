"""Explanations of teams whose robots are all realizable, and warnings of check."""

import json
from pathlib import Path

import pytest

from explain.conftest import Invoke
from once import beside
from safenav.cli.synth import explain
from safenav.report.terminal.explanation_text import postmortem_lines
from safenav.review.postmortem import Postmortem, explain_run
from safenav.runtime.run.mission import default_synthesizer
from safenav.scenario.reading.catalogue import built_in
from safenav.scenario.reading.loader import load_scenario_text

TEAM = beside(__file__, "scenarios/explain_team_team.yaml")
KEYS = f"""{TEAM}
robots:
  r: {{model: red, start: [1, 5], objective: {{visit: [[1, 5], [2, 3]]}}}}
  b: {{model: blue, start: [1, 9], objective: {{visit: [[1, 9], [2, 11]]}}}}
obstacles: [{{type: red_door, region: east}}, {{type: blue_door, region: west}}]
"""
LIFTER = f"""{TEAM}
robots:
  w: {{model: walker, start: [1, 5], objective: {{visit: [[1, 5], [2, 3]]}}}}
  ben: {{model: lifter, start: [3, 5], objective: {{hold: [3, 5]}}}}
obstacles: [{{type: crate, region: west}}]
"""
NARROW = """
safenav: 1
map: {grid: ["######", "#....#", "######"]}
robots:
  a: {model: quadcopter, start: 7, objective: {visit: [7, 10]}}
  b: {model: quadcopter, start: 10, objective: {visit: [10, 7]}}
until: {rounds: 1}
limits: {ticks: 60}
"""


def explained(text: str, seconds: float = 20.0) -> Postmortem:
    plan = load_scenario_text(text)
    return explain_run(plan, built_in().robots, lambda: default_synthesizer(plan), seconds)


def test_a_circle_of_keys_is_shown_link_by_link_with_repairs_that_were_run() -> None:
    found = explained(KEYS)
    assert found.result.cause == "cyclic_requests"
    assert [link.split(";")[0] for link in found.chain[-2:]] == [
        "red_door@east needs a robot with 'red_key'",
        "blue_door@west needs a robot with 'blue_key'",
    ]
    assert {repair.kind for repair in found.repairs} >= {"start", "robot", "wall"}
    starts = [repair.change for repair in found.repairs if repair.kind == "start"]
    assert (("robots.b.start", "b_button"),) in starts
    begun = KEYS.replace("model: blue, start: [1, 9]", "model: blue, start: b_button")
    assert explained(begun).result.outcome.value == "completed"


def test_a_lone_lifter_is_repaired_by_another_lifter() -> None:
    found = explained(LIFTER)
    assert found.result.cause == "no_capable_robot"
    kinds = {repair.kind: repair.change for repair in found.repairs}
    assert "model: lifter" in kinds["robot"][0][1]
    assert found.tried > len(found.repairs)


def test_lifters_with_room_on_one_side_only_are_explained() -> None:
    """No robot is named as stuck: it ended in an empty maximum."""
    found = explained("""
safenav: 1
map: {grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}
catalogue:
  robots: {lifter: {mobility: free, layer: ground, capabilities: [lift]}}
  obstacles: {crate: {needs: [{action: lift, robots: 2, at: neighbours, together: true}]}}
robots:
  leo: {model: lifter, start: [2, 1], objective: {visit: [[2, 1], [2, 7]]}}
  mia: {model: lifter, start: [1, 1], objective: {patrol: [[1, 1], [3, 1]]}}
obstacles: [{type: crate, region: [2, 4]}]
""")
    assert found.result.outcome.value == "operator_needed"
    assert "because no order of actions lets every robot continue:" in "\n".join(
        postmortem_lines(found, str)
    )
    assert found.tried


def test_a_deadlock_is_repaired_by_a_region_to_step_aside() -> None:
    found = explained(NARROW)
    assert found.result.cause == "deadlock"
    assert "deadlock; none of the" in found.chain[0]
    assert {repair.kind for repair in found.repairs} == {"wall"}


ROW = """
safenav: 1
map:
  grid: |
    #############
    #...........#
    #..########.#
    #############
  names: {gate: [1, 4], doubt: [1, 6], load: [1, 9], aside: [2, 2], hall: [1, 11]}
catalogue:
  obstacles:
    chest: {needs: [{action: glow, at: neighbours}, {action: hum, at: neighbours, same: true}]}
robots:
  cas: {model: cassie, start: [1, 1], heading: east, objective: {once: [hall]}}
  lev: {model: forklift, start: [2, 11], objective: {hold: [2, 11]}}
obstacles:
  - {type: door, region: gate}
  - {type: uncertainty, region: doubt, traversable: true}
  - {type: %s, region: load}
  - {type: smoke, region: aside, traversable: true}
until: {rounds: 1}
limits: {ticks: 200}
clock: %s
"""


@pytest.mark.parametrize(
    ("load", "last"),
    [
        ("crate", [(("lift",), ["mir250", "forklift"], ("lev",))]),
        ("chest", [(("glow", "hum"), [], ())]),
        ("debris", []),
    ],
)
def test_missing_actions_are_named_with_the_models_that_have_them(
    load: str,
    last: list[tuple[tuple[str, ...], list[str], tuple[str, ...]]],
    tmp_path: Path,
    invoke: Invoke,
) -> None:
    """Also for what the run does not reach; what is not in the way is not missed."""
    found = explained(ROW % (load, "lockstep"), seconds=0).missing
    assert [(each.actions, each.have) for each in found] == [
        (("push",), ()),
        (("sense",), ()),
        *((actions, have) for actions, _, have in last),
    ]
    assert found[0].models == ("digit", "spot") and "jackal" in found[1].models
    assert all(
        sorted(each.models) == sorted(models)
        for each, (_, models, _) in zip(found[2:], last, strict=True)
    )
    scenario = tmp_path / "s.yaml"
    scenario.write_text(ROW % (load, "lockstep"))
    said = invoke(explain, scenario).output
    assert (
        "in all, this team lacks:\n  - a robot with 'push' for door@gate; models: digit and spot\n"
        in said
    )


@pytest.mark.parametrize("clock", ["lockstep", "live"])
def test_one_repair_supplies_all_missing_actions(clock: str) -> None:
    """To one model, or by several robots; none of them helps with a part of it. Also in a live run,
    which takes longer on its clock than the search."""
    found = explained(ROW % ("debris", clock))
    given = [repair for repair in found.repairs if repair.kind == "capability"]
    values = [change for repair in given for change in repair.change]
    assert values == [
        ("catalogue.robots.cassie.capabilities", "[push, sense]"),
        ("catalogue.robots.forklift.capabilities", "[clear, lift, push, sense]"),
    ]
    assert all((repair.makespan or 0.0) > 5.0 for repair in given if clock == "live")


def test_explain_prints_text_and_json(tmp_path: Path, invoke: Invoke) -> None:
    scenario = tmp_path / "s.yaml"
    scenario.write_text(LIFTER)
    answer = invoke(explain, scenario)
    assert answer.status == 1
    assert "2. crate@west needs two robots with 'lift'; this team has one: ben" in answer.output
    assert "With any one of these repairs, a run was completed:" in answer.output
    told = json.loads(invoke(explain, scenario, "--json").output)
    assert told["cause"] == "no_capable_robot"
    assert told["repairs"] and told["chain"]
