"""Runs with many keys, faults of the world, and an operator who intervenes at random.

Among the tests the campaign is short; SAFENAV_FUZZ=1000 tries as many other seeds.
"""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from drawn import tried
from fuzz.blend import continued, play
from fuzz.mixed import Data, formula_mission, mixed_mission
from fuzz.troubles import faults_of
from fuzz.watch import Watch
from safenav.audit.check import check_trace
from safenav.errors import InputError, UsageError
from safenav.lines import json_line
from safenav.runtime import instant
from safenav.runtime.intervention.reading import read_intervention
from safenav.runtime.run.mission import Mission
from safenav.scenario.reading.loader import load_scenario_text
from safenav.synthesis.strategy import Strategy
from safenav.trace.writing import as_data

COUNT = int(os.environ.get("SAFENAV_FUZZ", "6"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "9000")) if "SAFENAV_FUZZ" in os.environ else 0

FORMER = yaml.safe_load(Path(__file__).with_name("former_findings.yaml").read_text())
WAYS = [(True, True, False), (True, False, True), (True, True, True), (False, False, True)]


@pytest.mark.parametrize("former", FORMER, ids=lambda former: former["when"])
def test_a_run_that_once_ended_in_a_finding_is_sound(former: dict[str, Any]) -> None:
    seed, ways, cuts = former["seed"], former.get("ways", ()), former.get("cuts")
    made = formula_mission if "formulas" in ways else mixed_mission
    data = made(seed, live="live" in ways)
    about: Any = {"faults": faults_of(seed) if "faults" in ways else None}
    about["operator"] = "operator" in ways
    if cuts is None:
        one = play(data, seed, **about)
    else:
        one = continued(data, seed, **about, **dict(zip(("at", "again"), cuts, strict=False)))
    assert not one.found
    assert one.cuts == len(cuts or ()) or not cuts
    assert one.outcome == former.get("ends", one.outcome)


@pytest.mark.parametrize(("live", "faults", "operator"), WAYS)
@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_a_run_with_faults_and_an_operator_is_sound(
    seed: int, live: bool, faults: bool, operator: bool, played: Callable[[], None]
) -> None:
    about: Any = {"faults": faults_of(seed) if faults else None, "operator": operator}
    one, _ = tried(lambda drawn: play(mixed_mission(drawn, live=live), seed, **about), seed)
    assert not one.found
    played()


@pytest.mark.parametrize("live", [True, False], ids=["live", "lockstep"])
@pytest.mark.parametrize("seed", range(FIRST, FIRST + COUNT))
def test_a_run_that_is_killed_continues(seed: int, live: bool, played: Callable[[], None]) -> None:
    one, _ = tried(lambda drawn: continued(mixed_mission(drawn, live=live), seed), seed)
    assert not one.found
    if one.cuts:
        played()


def slow_mission(seed: int, *, live: bool) -> Data:
    """One in which each step of r1 takes two ticks, with little time."""
    made = mixed_mission(seed, live=live)
    made["catalogue"]["robots"]["m1"]["timing"] = 2
    return {**made, "until": {"rounds": 1, "by": 13}}


def hall_mission(seed: int, *, live: bool) -> Data:  # noqa: ARG001
    """Three robots that pass each other with little charge."""
    cart = {"mobility": "free", "layer": "ground", "battery": {"capacity": 10, "charge": 2}}
    ways = (21, "patrol", 16, 10), (10, "visit", 15, 16), (16, "visit", 13, 11)
    robots = {
        f"r{start}": {"model": "cart", "start": start, "objective": {kind: targets}}
        for start, kind, *targets in ways
    }
    rows = {"map": {"grid": ["#########", "#.......#", "###.#.###", "#########"]}, "robots": robots}
    more = {"catalogue": {"robots": {"cart": cart}}, "chargers": [15, 10]}
    return {"safenav": 1, "until": {"rounds": 2}, "seed": seed, **rows, **more}


EXCUSED = {
    "a flat battery beside other robots": (hall_mission, 1, False, 9),
    "late where a step is repeated": (slow_mission, 172321, False, 19),
    "formulas that forbid a robot to stay": (formula_mission, 149415, True, 52),
    "formulas in the middle of a joint plan": (formula_mission, 171360, True, 87),
}


@pytest.mark.parametrize("excuse", EXCUSED)
def test_a_continued_run_may_have_another_outcome_for_a_known_reason(excuse: str) -> None:
    made, seed, live, at = EXCUSED[excuse]
    one = continued(made(seed, live=live), seed, at=at)
    assert not one.found
    assert {*one.excuses} == {excuse}


CART = """
safenav: 1
map: {grid: ["....."]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: []}}
  obstacles: {gate: {action: push}}
robots: {c: {model: cart, start: 0, objective: {visit: [4, 0]}}}
obstacles: [{type: gate, region: 2}]
until: {rounds: 1}
"""


def waiting(clock: str) -> Mission:
    """A mission that has met the gate, and waits for an operator if it is live."""
    scenario = load_scenario_text(f"{CART}clock: {clock}\n")
    mission = Mission(scenario, attended=clock == "live")
    mission.start()
    while not mission.state.knowledge.obstacles and mission.result is None:
        mission.step()
    return mission


@pytest.mark.parametrize(
    ("clock", "word", "said"),
    [
        ("live", "put_back c 2", "gate@2 is in region 2: resolve it first"),
        ("lockstep", "put_back c 1", "robots are put back only in live runs"),
        ("lockstep", "permanent gate@2", "obstacles become permanent only in live runs"),
    ],
)
def test_an_impossible_intervention_is_refused_with_its_reason(
    clock: str, word: str, said: str
) -> None:
    mission = waiting(clock)
    with pytest.raises(UsageError, match=said):
        mission.intervene(read_intervention(word, mission.state.scenario))


def test_a_robot_can_be_put_back_where_an_obstacle_was_resolved() -> None:
    mission = waiting("live")
    for word in ("resolved gate@2", "put_back c 2", "resolved gate@2"):
        mission.intervene(read_intervention(word, mission.state.scenario))
    mission.step()
    assert mission.state.robots["c"].pose.region == 2
    while mission.result is None:
        mission.step()
    assert mission.result.outcome == "completed"


def test_the_judge_finds_overlaps_entries_and_steps_without_charge() -> None:
    """Two robots in one region, one in a known obstacle, and one that sets out without charge."""
    model = {"layer": "ground", "capabilities": [], "battery": {"capacity": 1, "stay": 0}}
    robots = {
        "a": {"model": "m", "start": 4, "objective": {"visit": [5], "avoid": [6]}},
        "b": {"model": "m", "start": 6, "objective": {"visit": [6]}},
    }
    data = {
        "map": {"grid": ["####", "....", "####"]},
        "catalogue": {"robots": {"m": model}},
        "robots": robots,
        "obstacles": [],
    }
    step = {"log": "start", "robot": "a", "command": 1, "busy": False, "stops": None}
    end = {"log": "end", "robot": "a", "how": "arrived", "within": None}
    told = {"log": "told", "robot": "a", "event": "arrived", "fatal": False, "command": 1}
    log = [
        {"log": "shown", "t": 0.0, "obstacle": "door@5"},
        {**step, "t": 0.0, "origin": 4, "to": 5, "stops": "door@5"},
        {**end, "t": 1.0, "at": 5},
        {**told, "t": 1.0},
        {**step, "t": 1.0, "origin": 5, "to": 6},
    ]
    assert [defect.split(": ")[1] for defect in Watch(data, log).defects] == [
        "a is sent into door@5, which is known",
        "a and b have [6] at the same time",
        "a sets out for 6, which it avoids",
        "a sets out with a charge of 0",
    ]


def test_a_robot_with_a_battery_refuses_an_objective_without_an_order_of_targets() -> None:
    """It would forget at each charge which targets it has met."""
    text = CART.replace("capabilities: []", "capabilities: [], battery: {capacity: 9, charge: 3}")
    text += "chargers: [0]\nchanges: [{at: 3, robot: c, objective: {cover: [1, 0]}}]\n"
    with pytest.raises(InputError, match="without an order of its targets"):
        load_scenario_text(text)
    mission = Mission(load_scenario_text(text.replace("cover", "visit")))
    with pytest.raises(UsageError, match="without an order of its targets"):
        read_intervention("objective c {cover: [1, 0]}", mission.state.scenario)


@pytest.mark.parametrize("helped", [False, True], ids=["alone", "an operator helps"])
def test_a_run_in_which_no_time_passes_ends_at_its_search_limit(
    monkeypatch: pytest.MonkeyPatch, helped: bool
) -> None:
    """As if the robot did not continue from another node where its strategy steps aside."""
    monkeypatch.setattr(Strategy, "alike", lambda *_: ())
    monkeypatch.setattr(instant, "MOST_PASSES", (20, 5))
    lines: list[str] = []
    listener = [lambda record: lines.append(json_line(as_data(record)))]
    scenario = load_scenario_text(json.dumps(mixed_mission(158436, live=True)))
    mission = Mission(scenario, listeners=listener, attended=helped)
    mission.start()
    while mission.result is None:
        if mission.waiting is not None:
            assert mission.waiting.outcome == "search_limit"
            mission.intervene(read_intervention("resolved t1@8", scenario))
        mission.step()
    said = "no time passes in 26 passes of r0 (violation, backtrack)"
    assert (said in mission.result.explanation) is not helped
    assert mission.result.outcome == ("completed" if helped else "search_limit")
    assert not check_trace(lines).findings
