"""Runs with many keys, faults of the world, and an operator who intervenes at random.

Among the tests the campaign is short; SAFENAV_FUZZ=1000 tries as many other seeds.
"""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from drawn import tried
from fuzz.blend import play
from fuzz.mixed import formula_mission, mixed_mission
from fuzz.troubles import faults_of
from fuzz.watch import Watch
from safenav.errors import InputError, UsageError
from safenav.runtime.intervention.reading import read_intervention
from safenav.runtime.run.mission import Mission
from safenav.scenario.reading.loader import load_scenario_text

COUNT = int(os.environ.get("SAFENAV_FUZZ", "6"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "9000")) if "SAFENAV_FUZZ" in os.environ else 0

FORMER = yaml.safe_load(Path(__file__).with_name("former_findings.yaml").read_text())
WAYS = [(True, True, False), (True, False, True), (True, True, True), (False, False, True)]


def former_findings() -> Iterator[Any]:
    """The runs by name; ``open``: why a finding is known and not mended."""
    for former in FORMER:
        why = former.get("open")
        marks = [] if why is None else [pytest.mark.xfail(reason=why, strict=True)]
        yield pytest.param(former, id=former["when"], marks=marks)


@pytest.mark.parametrize("former", [*former_findings()])
def test_a_run_that_once_ended_in_a_finding_is_sound(former: dict[str, Any]) -> None:
    seed, ways = former["seed"], former.get("ways", ())
    made = formula_mission if "formulas" in ways else mixed_mission
    data = made(seed, live="live" in ways)
    about: Any = {"faults": faults_of(seed) if "faults" in ways else None}
    about["operator"] = "operator" in ways
    one = play(data, seed, **about)
    assert not one.found
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
    while not mission._run.state.requests and mission.waiting is None and mission.result is None:
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
        mission.intervene(read_intervention(word, mission.scenario))


def test_a_robot_can_be_put_back_where_an_obstacle_was_resolved() -> None:
    mission = waiting("live")
    for word in ("resolved gate@2", "put_back c 2", "resolved gate@2"):
        mission.intervene(read_intervention(word, mission.scenario))
    mission.step()
    assert mission._run.state.robots[0].pose == 2
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
        read_intervention("objective c {cover: [1, 0]}", mission.scenario)
