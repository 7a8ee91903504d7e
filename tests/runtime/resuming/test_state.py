"""Knowledge and loads of robots at the cut of a run are kept in its rest."""

import json
import random

import pytest
from msgspec.structs import replace
from safenav.runtime.analysis.resuming import resumed

from once import SCENARIOS
from runtime.facts import case
from runtime.played import Run, begin, completed, loaded, play
from runtime.resuming.cuts import DUE, begun, continued
from runtime.test_operator import GATE, attended
from safenav.audit.check import audit
from safenav.runtime.intervention.kinds import SetInput
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.settings import Clock
from safenav.trace.header import scenario_header
from safenav.trace.reading import read_bytes, read_lines

ORDERS, BATTERY, CLOSED, ALARM = (
    case(f"resumed/{name}") for name in ("loads", "charge", "untraversable", "alarm")
)


@pytest.mark.parametrize("name", ["case_study_3", "corridor_swap", "beam", "two_digits"])
def test_a_run_that_is_cut_off_is_completed_by_its_rest(name: str, clock: str) -> None:
    whole = play(replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock(clock))).lines
    rng = random.Random(f"{name} {clock}")
    for end in rng.sample(range(1, len(whole) - 1), 2):
        torn = "".join(whole[:end]) + '{"type":"mo'
        completed(resumed(read_bytes(torn.encode())))


def test_the_rest_begins_without_resolved_obstacles_where_robots_stood() -> None:
    """After the door of case study 3 is open, robots begin where they are, without the door."""
    run = play(load_scenario(SCENARIOS / "case_study_3.yaml"))
    first = run.upto("resolved")
    scenario = resumed(read_lines(first))
    assert [o.name for o in scenario.obstacles] == ["uncertainty@43"]
    moved = {one["robot"]: one["to"] for one in map(json.loads, first) if one["type"] == "move"}
    assert {robot.name: robot.start.region for robot in scenario.robots} == moved


CHANGED = """
map: {grid: ["......", "......"]}
robots:
  a: {model: quadcopter, start: 0, objective: {visit: [0, 5]}}
  b: {model: husky, start: 6, objective: {hold: 6}}
changes:
  - {at: 2, robot: b, service: out}
  - {at: 4, robot: a, objective: {cover: [1, 2]}}
  - {at: 9, robot: b, service: back}
  - {at: 9, robot: a, objective: {hold: 3}}
"""


def test_changes_to_come_are_known_from_the_trace_alone(clock: str) -> None:
    scenario = loaded(f"{CHANGED}clock: {clock}\n")
    lines = play(scenario).upto("service")
    rest = resumed(read_lines(lines))
    assert rest.changes == resumed(read_lines(lines), scenario).changes
    assert [(each.robot, each.active) for each in rest.changes] == (
        [("b", False), ("a", None), ("b", True), ("a", None)]
    )


def test_the_rest_of_a_refused_run_is_refused() -> None:
    scenario = loaded(DUE % (10, "stop"))
    run = play(scenario)
    assert run.outcome["outcome"] == "unrealizable"
    assert continued(run, 1, scenario).outcome["outcome"] == "unrealizable"


def test_an_objective_that_an_input_gave_ends_with_the_input_in_the_rest() -> None:
    """The robot has its own objective afterwards, and the input goes off at the same time."""
    scenario = loaded(ALARM)
    rest = resumed(read_lines(play(scenario).upto("objective")), scenario)
    (robot,), (alarm,) = rest.robots, rest.inputs
    assert {*robot.objective.targets} == {*scenario.robots[0].objective.targets}
    assert alarm.spans == ((1, 3),)  # its first tick is the one in which the trace ends
    completed(rest)


def test_an_untraversable_region_stays_closed_in_the_rest() -> None:
    """Nor does the truth of another one change when the first is left out of the draw."""
    scenario = loaded(CLOSED)
    first = read_lines(play(scenario).upto("blocked"))
    for given in (None, scenario):
        left = {o.name: o.traversable for o in resumed(first, given).obstacles}
        assert left == {"uncertainty@2": False, "uncertainty@7": True}
    rest = completed(resumed(first, scenario))
    assert "uncertainty@2" not in [line["obstacle"] for line in rest.all("resolved")]
    shut = rest.all("synthesis", robot="r")[0]["closed"]
    assert shut == [[2, "obstacles.uncertainty@2"]]


def test_open_requests_are_known_from_the_start_of_the_rest(clock: str) -> None:
    """From the first encounter on: it is asked for at once, and no robot meets it there again."""
    run = play(replace(load_scenario(SCENARIOS / "case_study_3.yaml"), clock=Clock(clock)))
    first = len(run.upto("violation"))
    for end in (first, first + 2, first + 5):
        rest = continued(run, end)
        assert rest.records[0]["scenario"]["begun"]["asked"] == {"uncertainty@43": {"digit": 44}}
        asked = rest.all("request")[0]
        assert (asked["tick"], asked["requester"], asked["helper"]) == (1, "digit", "quad")
        assert rest.all("violation", obstacle="uncertainty@43") == []
        assert rest.outcome["outcome"] == "completed"


BACK = "objective cart {visit: [[1, 1], [2, 1]]}"


@pytest.mark.parametrize(
    ("line", "index", "answers", "asked", "waits"),
    [
        ("violation", 0, ["resolved gate@27"], {"gate@27": {"cart": 26}}, 1),
        ("waiting", 0, ["resolved gate@27"], {"gate@27": {"cart": 26}}, 1),
        ("reopened", 0, ["service bee back", "resolved gate@27"], {"gate@27": {"cart": 26}}, 1),
        ("operator", 2, [BACK], {}, 1),
        ("waiting", 2, [BACK], {}, 1),
        ("objective", 0, [], {}, 0),
    ],
)
def test_a_run_cut_in_a_wait_for_an_operator_still_waits(
    line: str, index: int, answers: list[str], asked: dict[str, object], waits: int
) -> None:
    """With what he has said before: it stays out of service, or where it is."""
    words = [["service bee out"], ["service bee back", "permanent gate@27"], [BACK]]
    first = read_lines(attended(GATE, *words).upto(line, index))
    rest = resumed(first, loaded(GATE))
    assert begun(rest).asked == asked
    assert begun(rest).stays == (() if asked else ("gate@27",))
    run = attended(rest, *([answers] if answers else []))
    assert run.outcome["outcome"] == "completed"
    assert len(run.all("waiting")) == waits
    assert run.all("violation") == []
    assert audit(read_lines(run.lines), first).findings == ()


IN_THE_WAY = """
map: {grid: ["....."]}
robots:
  a: {model: husky, start: 0, objective: {visit: [2, 0]}}
  d: {model: digit, start: 4, heading: west, objective: {hold: 4}}
obstacles: [{type: door, region: 2, from: 3}]
"""


def test_an_obstacle_appears_where_a_robot_has_left() -> None:
    """In the tick after that, also if the run is cut off between the two."""
    scenario = loaded(IN_THE_WAY)
    whole = play(scenario)
    appeared = whole.one("appeared")
    for end in range(2, whole.records.index(appeared)):
        rest = continued(whole, end, scenario)
        had = bool(begun(resumed(read_lines(whole.lines[:end]), scenario)).had)
        over = whole.records[end - 1]["tick"] - had
        assert over + rest.one("appeared")["tick"] == appeared["tick"], end


TWO_CARRY = """
map: {grid: [".......", "......."]}
catalogue:
  robots: {arm: {mobility: free, layer: ground, capabilities: [take, put]}}
  obstacles:
    beam:
      needs:
        - {action: take, at: [7, 1], robots: 2, together: true}
        - {action: put, at: [13, 6], robots: 2, together: true, same: true}
      blocks: []
robots:
  a: {model: arm, start: 2, objective: {visit: [4, 5]}}
  b: {model: arm, start: 9, objective: {visit: [12, 11]}}
  c: {model: arm, start: 10, objective: {hold: 10}}
orders: [{at: 2, type: beam, region: 13}]
until: {rounds: 1}
"""


@pytest.mark.parametrize("text", [ORDERS, TWO_CARRY], ids=["one", "two"])
def test_a_load_is_taken_once_in_a_run_and_its_rest(text: str, clock: str) -> None:
    """Robots that carry it when the run is cut off put it down."""
    scenario = loaded(f"{text}\nclock: {clock}\n")
    run = play(scenario)
    begin, last = len(run.upto("met")), len(run.upto("met", -1)) - 1
    for end in range(begin, last, max(1, (last - begin + 1) // 5)):
        rest = continued(run, end, scenario)
        met = Run(run.records[:end]).all("met") + rest.all("met")
        taken = [(one["obstacle"], one["need"]) for one in met]
        assert sorted(taken) == sorted({*taken}), end
        assert rest.outcome["outcome"] == "completed", end
        again = play(resumed(read_lines(rest.lines[:12])))  # and once more
        assert again.outcome["outcome"] == "completed", end


def test_a_robot_keeps_its_load_in_the_rest() -> None:
    rest = resumed(read_lines(play(ORDERS).upto("met")))
    assert [(o.name, len(o.needs), o.ordered) for o in rest.obstacles] == [
        ("load@13", 2, True),
        ("load@13#2", 2, True),
    ]
    assert begun(rest).met == {"load@13#2": (("a",),)}


def test_a_robot_keeps_its_charge_in_the_rest() -> None:
    """It has charged to 12 and made six steps; its stop at the charger is no target met."""
    scenario = loaded(BATTERY.replace("visit: [6, 0]", "visit: [6, 5, 0]"))
    rest = resumed(read_lines(play(scenario).upto("goal", 1)), scenario)
    assert begun(rest).robots["c"].turn == 1
    battery = rest.robots[0].model.battery
    assert battery is not None
    assert battery.start == 6


def test_a_model_of_the_scenario_keeps_its_motion_in_the_rest() -> None:
    """Seconds of a live run follow from it, and the motion of the rest."""
    model = "{mobility: free, layer: ground, size: 0.8, speed: 0.3, motion: rover}"
    text = CLOSED.replace("robots:", f"catalogue: {{robots: {{husky: {model}}}}}\nrobots:", 1)
    first = read_lines(play(text).upto("move"))
    header = scenario_header(resumed(first), None).robots["r"].motion
    assert header == first.header.scenario.robots["r"].motion
    assert header is not None
    assert (header["kind"], header["speed"]) == ("rover", 0.3)


@pytest.mark.parametrize(
    ("on", "outcome", "last"),
    [(True, "limit", [3, 4]), (False, "completed", [0, 1])],  # else the alarm is on from 2 to 8
    ids=["on", "off"],
)
def test_an_input_set_by_a_user_keeps_its_value_in_the_rest(
    on: bool, outcome: str, last: list[int], clock: str
) -> None:
    text = ALARM.replace("2-4", "2-8").replace("rounds: 1}", "rounds: 3}\nlimits: {ticks: 30}")
    scenario = loaded(f"{text}\nclock: {clock}\n")
    mission, first = begin(scenario)
    mission.step()
    mission.intervene(SetInput("alarm", on))
    mission.step()
    mission.step()
    mission.give_up()
    assert not first.findings
    assert first.all("inputs")[-1]["user"] == ["alarm"]
    rest = play(resumed(read_lines(first.lines), scenario))
    assert rest.outcome["outcome"].endswith(outcome)
    assert sorted({goal["region"] for goal in rest.all("goal")}) == last


BEHIND = """
map: {grid: [".....", "....."]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, battery: {capacity: 12, charge: 4, stay: 1}}
    eye: {mobility: free, layer: air, capabilities: [push], timing: 2}
  obstacles: {gate: {action: push, blocks: [ground]}}
robots:
  a: {model: cart, start: 0, objective: {visit: [0, 4]}}
  b: {model: eye, start: 9, objective: {hold: 9}}
obstacles: [{type: gate, region: 2}, {type: gate, region: 7}]
chargers: [4]
until: {rounds: 1}
"""


@pytest.mark.parametrize("first", ["a", "b"])
def test_a_request_is_due_for_the_charge_at_the_end_of_the_tick(first: str) -> None:
    """The requester's turn of tick 1 is to come, or it has had it in the run before."""
    scenario = loaded(BEHIND)
    robots = sorted(scenario.robots, key=lambda robot: robot.name != first)
    scenario = replace(scenario, robots=tuple(robots))
    whole, dues = play(scenario), set[int]()
    last = len(whole.upto("resolved"))
    for end in range(last - 5, last):
        tick = whole.records[end - 1]["tick"]
        rest = continued(whole, end, scenario)
        due = rest.all("deadline", verdict="set")
        had = rest.records[0]["scenario"]["begun"]["had"]
        dues |= {tick - bool(had) + one["due"] for one in due}
    assert dues == {9}


TWICE = """
map: {grid: ["..........", "##########"]}
robots:
  r: {model: digit, start: 0, heading: east, objective: {once: [3, 9]}, when: {alarm: {hold: 9}}}
  q: {model: quadcopter, start: 9, objective: {hold: 9}}
obstacles: [{type: door, region: 2}, {type: door, region: 6}]
inputs: {alarm: {at: ["30"]}}
changes: [{at: 14, robot: q, objective: {hold: 8}}]
until: {rounds: 1, by: 22}
"""


def test_the_rest_of_a_rest_begins_where_that_ends() -> None:
    """Also with the scenario of the whole run, whose doors are open and whose times are past."""
    scenario = loaded(TWICE)
    run = completed(scenario)
    for tick in (5, 2):
        ticks = [line.get("tick", 0) for line in run.records]
        rest = resumed(read_lines(run.lines[: ticks.index(tick)]), scenario)
        run = play(rest)
    assert [obstacle.name for obstacle in rest.obstacles] == ["door@6"]
    assert (rest.until.by, [change.at for change in rest.changes]) == (17, [9])
    assert rest.inputs[0].spans == ((25, 25),)
