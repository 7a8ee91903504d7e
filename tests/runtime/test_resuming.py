"""Runs that are cut off anywhere continue from what their traces say."""

import json
import random
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

import warm
from once import SCENARIOS
from runtime.counting import COUNTING
from runtime.played import Line, Run, loaded, play, whole
from runtime.test_operator import GATE, attended
from safenav import Mission
from safenav.audit.check import audit
from safenav.begun import Begun, Done
from safenav.certify.bundle import make_bundle
from safenav.certify.check import check_bundle
from safenav.certify.record import syntheses_of
from safenav.certify.run import Kept
from safenav.errors import UsageError
from safenav.runtime.analysis.resuming import resumed
from safenav.runtime.mission import default_synthesizer
from safenav.runtime.user_changes import SetInput
from safenav.scenario.model import Scenario
from safenav.scenario.reading.joining import joined
from safenav.scenario.reading.loader import load_scenario
from safenav.scenario.settings import Clock
from safenav.synthesis.cache import Cache
from safenav.trace.header import scenario_header
from safenav.trace.reading import read_bytes, read_lines, read_trace

BACK = "objective cart {visit: [[1, 1], [2, 1]]}"


def begun(rest: Scenario) -> Begun:
    assert rest.begun is not None
    return rest.begun


def continued(run: Run, end: int, scenario: Scenario | None = None) -> Run:
    return play(resumed(read_lines(run.lines[:end]), scenario))


def with_another(rest: Scenario) -> Scenario:
    """The rest with a robot that joins the team where no other is."""
    place = min({*rest.map.free} - {robot.start.region for robot in rest.robots})
    return joined(rest, f"bee: {{model: quadcopter, start: {place}, objective: {{hold: {place}}}}}")


def goals(records: Iterable[Line]) -> list[tuple[str, int, int]]:
    return [(one["robot"], one["goal"], one["round"]) for one in records if one["type"] == "goal"]


@pytest.mark.parametrize("clock", ["live", "lockstep"])
@pytest.mark.parametrize("name", ["case_study_3", "corridor_swap", "beam", "two_digits"])
def test_a_run_that_is_cut_off_continues(name: str, clock: str) -> None:
    whole = play(replace(load_scenario(SCENARIOS / f"{name}.yaml"), clock=Clock(clock))).lines
    rng = random.Random(f"{name} {clock}")
    for end in rng.sample(range(1, len(whole) - 1), 2):
        torn = "".join(whole[:end]) + '{"type":"mo'
        assert play(resumed(read_bytes(torn.encode()))).outcome["outcome"] == "completed"


def test_what_is_known_is_kept() -> None:
    """After the door of case study 3 is open, robots begin where they are, without the door."""
    run = play(load_scenario(SCENARIOS / "case_study_3.yaml"))
    first = run.upto("resolved")
    scenario = resumed(read_lines(first))
    assert [o.name for o in scenario.obstacles] == ["uncertainty@43"]
    moved = {one["robot"]: one["to"] for one in map(json.loads, first) if one["type"] == "move"}
    assert {robot.name: robot.start.region for robot in scenario.robots} == moved


def test_a_literal_objective_stays_literal() -> None:
    original = loaded("""
        map: {grid: [".....", "....."]}
        robots:
          r: {model: husky, start: 5, objective: {circuit: [4, 0, 9], form: literal, avoid: 2}}
        """)
    rest = resumed(read_lines(play(original).upto("goal")))
    assert rest.robots[0].objective == original.robots[0].objective
    assert begun(rest).robots["r"].turn == 1


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


@pytest.mark.parametrize("clock", ["lockstep", "live"])
def test_changes_to_come_are_known_from_the_trace_alone(clock: str) -> None:
    scenario = loaded(f"{CHANGED}clock: {clock}\n")
    lines = play(scenario).upto("service")
    rest = resumed(read_lines(lines))
    assert rest.changes == resumed(read_lines(lines), scenario).changes
    assert [(each.robot, each.active) for each in rest.changes] == (
        [("b", False), ("a", None), ("b", True), ("a", None)]
    )


def test_what_a_trace_does_not_describe_is_named() -> None:
    first = read_lines(play(load_scenario(SCENARIOS / "battery_delivery.yaml")).lines[:20])
    said = "does not fully describe batteries: also name the scenario"
    with pytest.raises(UsageError, match=said):
        resumed(first)


def test_a_run_that_never_began_is_refused_again() -> None:
    scenario = loaded(DUE % (10, "stop"))
    run = play(scenario)
    assert run.outcome["outcome"] == "unrealizable"
    assert continued(run, 1, scenario).outcome["outcome"] == "unrealizable"


def test_a_finished_run_is_not_resumed(tmp_path: Path) -> None:
    path, rest = tmp_path / "trace.jsonl", tmp_path / "rest.jsonl"
    lines = play(load_scenario(SCENARIOS / "hello.yaml")).lines
    with pytest.raises(UsageError, match="nothing to resume"):
        resumed(read_lines(lines))
    path.write_text("".join(lines))
    assert warm.safenav("resume", path).returncode == 2
    path.write_text("".join(lines[:9]))
    assert warm.safenav("resume", path, "--trace", rest, "--no-map").returncode == 0
    assert json.loads(rest.read_text().splitlines()[-1])["outcome"] == "completed"


def test_a_resumed_run_has_a_page_a_result_and_limits(tmp_path: Path) -> None:
    path, page = tmp_path / "trace.jsonl", tmp_path / "rest.html"
    text = "".join(play(load_scenario(SCENARIOS / "hello.yaml")).lines[:9])
    path.write_text(text)
    done = warm.safenav("resume", path, "--json", "--html", page, "--max-ticks", "1")
    assert done.returncode == 3
    assert json.loads(done.stdout)["outcome"] == "tick_limit"
    assert page.read_text().startswith("<!doctype html>")
    refused = warm.safenav("resume", path, "--html", path)
    assert refused.returncode == 2 and "would overwrite the trace" in refused.stderr
    assert path.read_text() == text


ORDERS = """
map: {grid: [".......", "......."]}
catalogue:
  robots: {arm: {mobility: free, layer: ground, capabilities: [take, put]}}
  obstacles:
    load: {needs: [{action: take, at: [0]}, {action: put, at: [13], same: true}], blocks: []}
robots: {a: {model: arm, start: 3, objective: {visit: [6, 7]}}}
orders: [{at: 2, type: load, region: 13}, {at: 2, type: load, region: 13}]
until: {rounds: 1}
"""
COMES_BACK = """
map: {grid: [".....", "....."]}
robots:
  d: {model: digit, start: 0, heading: east, objective: {visit: [4, 5]}}
  q: {model: quadcopter, start: 9, objective: {visit: [0, 9]}}
obstacles: [{type: door, region: 2, until: 6}, {type: door, region: 2, from: 8}]
"""
BATTERY = """
map: {grid: ["......."]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, battery: {capacity: 12, charge: 3, start: 0}}}
robots: {c: {model: cart, start: 0, objective: {visit: [6, 0]}}}
chargers: [0]
until: {rounds: 1}
"""
CLOSED = """
map: {grid: [".....", ".#.#.", "....."]}
robots:
  q: {model: quadcopter, start: 4, objective: {hold: 4}}
  r: {model: husky, start: 0, objective: {visit: [4, 0]}}
obstacles:
  - {type: uncertainty, region: 2, traversable: {probability: 0.01}}
  - {type: uncertainty, region: 7, traversable: {probability: 0.99}}
"""


@pytest.mark.parametrize(
    "text",
    [ORDERS, COMES_BACK, COUNTING, BATTERY, CLOSED],
    ids=["orders", "back", "memory", "charge", "closed"],
)
def test_a_run_continues_from_each_of_its_lines(text: str) -> None:
    scenario = loaded(text)
    run = play(scenario)
    for end in range(2, len(run.lines) - 1, 3):
        assert continued(run, end, scenario).outcome["outcome"] == "completed", end


ALARM = """
map: {grid: ["....."]}
robots:
  q: {model: quadcopter, start: 0, objective: {visit: [1, 0]}, when: {alarm: {visit: [4, 3]}}}
inputs: {alarm: {at: ["2-4"]}}
until: {rounds: 1}
"""


def test_what_an_input_has_changed_is_as_it_was() -> None:
    """The robot has its own objective afterwards, and the input goes off at the same time."""
    scenario = loaded(ALARM)
    rest = resumed(read_lines(play(scenario).upto("objective")), scenario)
    (robot,), (alarm,) = rest.robots, rest.inputs
    assert {*robot.objective.targets} == {*scenario.robots[0].objective.targets}
    assert alarm.spans == ((1, 3),)  # its first tick is the one in which the trace ends
    assert play(rest).outcome["outcome"] == "completed"


def test_what_turned_out_untraversable_stays() -> None:
    """Nor does the truth of another one change when the first is left out of the draw."""
    scenario = loaded(CLOSED)
    first = read_lines(play(scenario).upto("blocked"))
    for given in (None, scenario):
        left = {o.name: o.traversable for o in resumed(first, given).obstacles}
        assert left == {"uncertainty@2": False, "uncertainty@7": True}
    rest = play(resumed(first, scenario))
    assert rest.outcome["outcome"] == "completed"
    assert "uncertainty@2" not in [line["obstacle"] for line in rest.all("resolved")]
    shut = rest.all("synthesis", robot="r")[0]["closed"]
    assert shut == [[2, "obstacles.uncertainty@2"]]


@pytest.mark.parametrize("clock", ["lockstep", "live"])
def test_what_is_requested_is_known_in_the_rest(clock: str) -> None:
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
def test_a_run_that_waits_for_an_operator_still_does(
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


REMEMBERS = """
map: {grid: [".......", "......."]}
robots:
  r:
    model: husky
    start: 0
    objective:
      ltl: {memory: %s, init: %s, safety: %s, liveness: %s}
inputs: {alarm: {at: ["3-6"]}}
until: {rounds: 2}
"""
FORMULAS = {
    "flag": ({"m": "bool"}, "!m", ["m' <-> m | region = 6", "region' = 7 -> m'"], ["region = 7"]),
    "toggle": (
        {"m": "bool"},
        "!m",
        ["region' = 6 -> m'", "region' = 7 -> !m'", "region' != 6 & region' != 7 -> (m' <-> m)"],
        ["region = 6", "region = 7"],
    ),
    "input": ({"m": "bool"}, "!m", ["m' <-> m | alarm'"], ["region = 7", "region = 6"]),
    "range": (
        {"c": [0, 2]},
        "c = 0",
        [f"region' = 3 & region != 3 & c = {k} -> c' = {(k + 1) % 3}" for k in range(3)]
        + ["!(region' = 3 & region != 3) -> c' = c"],
        ["c = 2 & region = 5"],
    ),
}


@pytest.mark.parametrize("clock", ["lockstep", "live"])
@pytest.mark.parametrize("name", FORMULAS)
def test_formulas_remember_in_the_rest(name: str, clock: str) -> None:
    """What they do at each moment of the run, as the audit derives it, too."""
    scenario = loaded(REMEMBERS % tuple(map(json.dumps, FORMULAS[name])))
    run = Run()
    mission = Mission(replace(scenario, clock=Clock(clock)), listeners=[run])
    mission.start()
    for _ in range(24):
        mission.step()
        if mission.result is not None:
            break
        first, begins = read_lines(run.lines), Run()
        rest = resumed(first, mission.scenario)
        remembered = dict(mission.state.robots["r"].memory.values)
        assert begun(rest).robots["r"].memory == remembered, mission.state.tick
        Mission(rest, listeners=[begins]).start()
        assert audit(read_lines(begins.lines), first).findings == ()
        told = begins.records[0]["scenario"]["begun"]["robots"]["r"]
        told["memory"] = {key: int(not value) for key, value in told["memory"].items()}
        wrong = audit(read_lines(begins.lines), first).findings
        known = clock == "lockstep" and name != "input"  # else another one fits, too
        assert not known or any("memory" in one.explanation for one in wrong)


def test_what_comes_first_is_not_done_again() -> None:
    """The robot may enter 7 only after 6; cut on its way back, it goes straight there."""
    scenario = loaded(REMEMBERS % tuple(map(json.dumps, FORMULAS["flag"])))
    first = play(scenario).upto("move", **{"from": 6})
    rest = play(resumed(read_lines(first), scenario))
    assert 6 not in rest.path("r")
    assert rest.outcome["outcome"] == "completed"


@pytest.mark.parametrize(
    ("text", "last"),
    [
        (REMEMBERS % tuple(map(json.dumps, FORMULAS["flag"])), {"kind": "move", "from": 6}),
        ((SCENARIOS / "case_study_3.yaml").read_text(), {"kind": "violation"}),
    ],
    ids=["memory", "requests"],
)
def test_the_rest_is_certified(text: str, last: dict[str, Any], tmp_path: Path) -> None:
    rest = resumed(read_lines(play(text).upto(nth=-1, **last)), loaded(text))
    cache, kept, run = Cache(tmp_path / "cache"), Kept(), Run()
    synthesizer = default_synthesizer(rest, cache=cache)
    Mission(rest, synthesizer, listeners=[run], progress=kept).run()
    trace = run.text.encode()
    kept.complete(syntheses_of(trace, "rest"), cache, synthesizer)
    make_bundle(tmp_path / "bundle", trace, {}, kept, synthesizer)
    assert check_bundle(tmp_path / "bundle").accepted


@pytest.mark.slow
@pytest.mark.parametrize("clock", ["lockstep", "live"])
def test_a_joint_plan_is_followed_to_its_end(clock: str) -> None:
    """Wherever the run is cut: it takes no more ticks than the run that is not cut."""
    scenario = replace(load_scenario(SCENARIOS / "two_digits.yaml"), clock=Clock(clock))
    whole = play(scenario)
    lines = whole.lines
    ends = range(len(whole.upto("plan")), len(whole.upto("plan_end")) - 3, 7)
    for cut in ends:  # before the last arrival
        first = read_lines(lines[:cut])
        resume = resumed(first, scenario)
        plan = begun(resume).plan
        assert plan is not None
        assert begun(with_another(resume)).plan is None
        rest = play(resume)
        left = {name: [list(at) for at in way] for name, way in plan.robots.items()}
        assert rest.one("plan")["robots"] == left
        assert rest.outcome["outcome"] == "completed"
        if clock == "lockstep":
            before = whole.records[cut - 1]["tick"]
            assert rest.outcome["ticks"] + before <= whole.outcome["ticks"] + 1
        assert audit(read_lines(rest.lines), first).findings == ()
        header = rest.records[0]["scenario"]["begun"]
        header["plan"]["robots"]["left"].insert(1, header["plan"]["robots"]["left"][0])
        problems = audit(read_lines(rest.lines), first).findings
        assert "left has other places of the joint plan left" in problems[0].explanation
        header["plan"] = None
        problems = audit(read_lines(rest.lines), first).findings
        assert problems[0].explanation == "no joint plan must be continued"


@pytest.mark.parametrize("clock", ["lockstep", "live"])
def test_a_joint_plan_that_a_rest_has_not_begun_again(clock: str) -> None:
    """A rest that is cut before its first step hands the plan on as it was, and to no team with
    another robot."""
    scenario = replace(load_scenario(SCENARIOS / "two_digits.yaml"), clock=Clock(clock))
    whole = play(scenario)
    rest = continued(whole, len(whole.upto("plan")) + 8, scenario)
    second = read_lines(rest.upto("plan")[:-1])
    resume = resumed(second, scenario)
    for team in (resume, with_another(resume)):
        assert audit(read_lines(play(team).lines), second).findings == ()
    run = play(resume)
    run.records[0]["scenario"]["begun"]["plan"]["orders"].clear()
    problems = audit(read_lines(run.lines), second).findings
    assert problems[0].explanation == "the orders of the joint plan are not those of the first run"


CORRIDOR = """
map: {{grid: ["#########", "#{free}.###..#", "#.......#", "#..###..#", "#########"]}}
catalogue:
  robots:
    cart: {{mobility: free, layer: ground, capabilities: []}}
robots:
  a: {{model: cart, start: [2, 1], objective: {{visit: [[2, 7], [2, 1]]}}}}
  b: {{model: cart, start: [2, 7], objective: {{visit: [[2, 1], [2, 7]]}}}}
{more}
until: {{rounds: 2}}
clock: {clock}
"""
WEST = "never_together: [{robots: [a, b], in: [[2, 1], [2, 2], [1, 1], [1, 2], [3, 1], [3, 2]]}]"


@pytest.mark.parametrize("clock", ["lockstep", "live"])
@pytest.mark.parametrize("change", [{"free": "#"}, {"more": WEST}], ids=["a wall", "apart"])
def test_a_joint_plan_of_another_scenario_is_not_followed(
    change: dict[str, str], clock: str
) -> None:
    """Where its steps are no longer possible, or robots are to keep apart in other regions."""
    plain = {"free": ".", "more": "", "clock": clock}
    whole = play(loaded(CORRIDOR.format(**plain)))
    cut = len(whole.upto("plan")) + 5
    changed = loaded(CORRIDOR.format(**plain | change))
    resume = resumed(read_lines(whole.lines[:cut]), changed)
    assert begun(resume).plan is not None
    assert play(resume).outcome["outcome"] == "completed"


ONE_FLAG = """
map: {{grid: ["#########", "#.......#", "#########"]}}
robots:
  a:
    model: quadcopter
    start: [1, 1]
    objective:
      ltl: {{memory: {{{name}: bool}}, safety: {name}' <-> ({name} | region = 15),
             liveness: {name} & region = 10}}
until: {{rounds: 2}}
clock: {clock}
"""


@pytest.mark.parametrize("clock", ["lockstep", "live"])
@pytest.mark.parametrize("name", ["seen", "went"])
def test_other_formulas_begin_again(name: str, clock: str) -> None:
    """Their memory has other variables than that of the run before."""
    whole = play(loaded(ONE_FLAG.format(name="seen", clock=clock)))
    changed = loaded(ONE_FLAG.format(name=name, clock=clock))
    resume = resumed(read_lines(whole.upto("goal")), changed)
    assert ("a" in begun(resume).robots) is (name == "seen")
    assert play(resume).outcome["outcome"] == "completed"


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


@pytest.mark.parametrize("clock", ["lockstep", "live"])
@pytest.mark.parametrize("text", [ORDERS, TWO_CARRY], ids=["one", "two"])
def test_a_load_is_taken_once(text: str, clock: str) -> None:
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


def test_the_same_robot_keeps_a_load() -> None:
    rest = resumed(read_lines(play(ORDERS).upto("met")))
    assert [(o.name, len(o.needs), o.ordered) for o in rest.obstacles] == [
        ("load@13", 2, True),
        ("load@13#2", 2, True),
    ]
    assert begun(rest).met == {"load@13#2": (("a",),)}


def test_a_robot_keeps_its_charge() -> None:
    """It has charged to 12 and made six steps; its stop at the charger is no target met."""
    scenario = loaded(BATTERY.replace("visit: [6, 0]", "visit: [6, 5, 0]"))
    rest = resumed(read_lines(play(scenario).upto("goal", 1)), scenario)
    assert begun(rest).robots["c"].turn == 1
    battery = rest.robots[0].model.battery
    assert battery is not None
    assert battery.start == 6


def test_a_model_of_its_own_keeps_how_it_moves() -> None:
    """Seconds of a live run follow from it, and the motion of the rest."""
    model = "{mobility: free, layer: ground, size: 0.8, speed: 0.3, motion: rover}"
    text = CLOSED.replace("robots:", f"catalogue: {{robots: {{husky: {model}}}}}\nrobots:", 1)
    first = read_lines(play(text).upto("move"))
    header = scenario_header(resumed(first), None).robots["r"].motion
    assert header == first.header.scenario.robots["r"].motion
    assert header is not None
    assert (header["kind"], header["speed"]) == ("rover", 0.3)


def test_a_live_run_stays_live(tmp_path: Path) -> None:
    source, trace = tmp_path / "s.yaml", tmp_path / "whole.jsonl"
    source.write_text(whole(CLOSED))
    run = ("run", source, "--clock", "live", "--seed", "7", "--trace", trace)
    assert warm.safenav(*run).returncode == 0
    trace.write_text("".join(trace.read_text().splitlines(keepends=True)[:6]))
    again = resumed(read_trace(trace), load_scenario(source))
    assert (again.clock.value, again.seed) == ("live", 7)


DUE = """
map: {grid: ["..........", "##########"]}
robots: {r: {model: husky, start: 0, objective: {visit: [9, 0]}}}
until: {rounds: 1, by: %d}
late: %s
"""


@pytest.mark.parametrize(
    ("by", "late", "tick", "due", "outcome", "broken"),
    [
        (30, "stop", 4, 26, "completed", []),  # in time
        (18, "stop", 4, 14, "completed", []),
        (10, "stop", 4, 6, "late", ["mission"]),  # was possible once, is not refused
        (10, "go_on", 4, 6, "completed", ["mission"]),
        (10, "stop", 10, 0, "late", ["mission"]),  # its tick was over
        (10, "go_on", 14, 0, "completed", ["mission"]),  # it is late already, and still is
    ],
)
def test_a_deadline_is_due_at_the_same_time(
    by: int, late: str, tick: int, due: int, outcome: str, broken: list[str]
) -> None:
    """Of a run that was cut off in that tick; also if the rest cannot keep it."""
    scenario = loaded(DUE % (by, late))
    whole = play(replace(scenario, until=replace(scenario.until, by=99)))
    first = [line for line in whole.lines if json.loads(line).get("tick", 0) <= tick]
    rest = resumed(read_lines(first), scenario)
    assert rest.until.by == due
    run = play(rest)
    assert (run.outcome["outcome"], run.outcome["late"]) == (outcome, broken)


def test_a_run_that_its_deadline_has_ended_goes_on_without_it() -> None:
    scenario = loaded(DUE % (18, "stop"))
    until = replace(scenario.until, by=12)
    late = play(replace(scenario, until=until, begun=Begun(robots={"r": Done()}, ran=True)))
    assert late.outcome["outcome"] == "late"
    rest = resumed(read_lines(late.lines), scenario)
    assert rest.until.by is None
    assert play(rest).outcome["outcome"] == "completed"


@pytest.mark.parametrize("clock", ["lockstep", "live"])
@pytest.mark.parametrize(
    ("on", "outcome", "last"),
    [(True, "limit", [3, 4]), (False, "completed", [0, 1])],  # else the alarm is on from 2 to 8
    ids=["on", "off"],
)
def test_an_input_that_a_user_has_set_stays_so(
    on: bool, outcome: str, last: list[int], clock: str
) -> None:
    text = ALARM.replace("2-4", "2-8").replace("rounds: 1}", "rounds: 3}\nlimits: {ticks: 30}")
    scenario = loaded(f"{text}\nclock: {clock}\n")
    first = Run()
    mission = Mission(scenario, listeners=[first])
    mission.start()
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
    assert not rest.findings


FLAT = """
map: {grid: ["......."]}
catalogue:
  robots:
    cart: {mobility: free, layer: ground, battery: {capacity: 12, charge: 3, stay: 1, start: 2}}
    van: {mobility: free, layer: ground, capabilities: [lift]}
  obstacles: {empty: {needs: [{action: lift, at: neighbours}], blocks: []}}
robots:
  c: {model: cart, start: 3, objective: {visit: [4, 0]}}
  v: {model: van, start: 6, objective: {hold: 6}}
chargers: [0]
flat: empty
until: {rounds: 1}
"""


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


@pytest.mark.parametrize("clock", ["lockstep", "live"])
def test_a_run_continues_with_an_empty_battery(clock: str) -> None:
    scenario = loaded(f"{FLAT}clock: {clock}\n")
    rest = resumed(read_lines(play(scenario).upto("appeared")), scenario)
    battery = rest.robots[0].model.battery
    assert battery is not None
    assert battery.start == 0
    assert play(rest).outcome["outcome"] == "completed"


ONE = """
map: {grid: [".....", "....."]}
robots: {r: {model: husky, start: 0, objective: {%s}}}
until: {rounds: 3}
"""
DOOR = """
map: {grid: [".....", ".###.", "....."]}
robots:
  d: {model: digit, start: 10, heading: east, objective: {visit: [14, 10]}}
  q: {model: quadcopter, start: 0, objective: {visit: [4, 0], within: 9}}
obstacles: [{type: door, region: 2, resolve_within: 12}]
until: {rounds: 2}
"""
KINDS = {
    "visit": "visit: [2, 6, 4], within: 14",
    "patrol": "patrol: [2, 8], within: 9",
    "circuit": "circuit: [1, 5, 9]",
    "cover": "cover: [2, 8, 5]",
    "once": "once: [8, 1, 5]",
    "hold": "hold: 7",
    "shared": "visit: [{any: [2, 3]}, {any: [3, 7]}, 5]",
    "shared once": "once: [{any: [2, 3]}, {any: [3, 7]}, 5]",
}


@pytest.mark.parametrize("kind", KINDS)
def test_no_part_of_a_round_is_done_twice(kind: str) -> None:
    """Wherever the run is cut off, its rest meets the goals that are left, and completes it."""
    scenario = loaded(ONE % KINDS[kind])
    whole = play(scenario)
    met = goals(whole.records)
    for end in range(2, len(whole.records) - 1, 2):
        rest = continued(whole, end, scenario)
        assert rest.outcome["outcome"] == "completed", end
        assert rest.outcome["rounds"] == whole.outcome["rounds"], end
        before, after = goals(whole.records[:end]), goals(rest.records)
        if kind in ("once", "hold", "shared once") and before[-1:] == met[-1:]:
            assert {goal for _, goal, _ in after} == {before[-1][1]}  # it stays there
        else:
            assert before + after == met, end


def test_deadlines_keep_their_ages() -> None:
    """At the end of a tick those of the rest are due when those of the run are, and the mission
    is completed no later."""
    scenario = loaded(DOOR)
    whole = play(scenario)
    ticks = [line.get("tick", 0) for line in whole.records]
    due = {(line["of"], line["due"]) for line in whole.all("deadline")}
    for tick in range(3, 29, 5):
        rest = continued(whole, ticks.index(tick + 1), scenario)
        judged = {(one["of"], tick + one["due"]) for one in rest.all("deadline")}
        assert judged, tick
        assert judged <= due, tick
        assert tick + rest.outcome["ticks"] <= whole.outcome["ticks"]


TIGHT = """
map: {grid: ["#....#", "######", "......", "######", "......"]}
robots:
  a: {model: husky, start: 1, objective: {visit: [4, 1], within: 6}}
  b: {model: husky, start: 12, objective: {visit: [17, 12], within: 10}}
  c: {model: husky, start: 24, objective: {cover: [29, 24]}}
until: {rounds: 2, by: %d}
late: stop
"""


@pytest.mark.parametrize("by", [20, 19], ids=["in time", "late"])
def test_the_rest_is_late_where_the_run_is(by: int) -> None:
    """Though the tick in which the trace ends may not be over."""
    scenario, before = loaded(TIGHT % 20), Begun(robots={"a": Done()}, ran=True)
    scenario = replace(scenario, until=replace(scenario.until, by=by), begun=before)
    whole = play(scenario)
    assert whole.outcome["outcome"] == ("completed" if by == 20 else "late")
    for end in range(2, len(whole.records) - 1, 3):
        if whole.records[end]["type"] != "deadline":
            rest = continued(whole, end, scenario)
            assert rest.outcome["outcome"] == whole.outcome["outcome"], end


@pytest.mark.parametrize(
    ("end", "robot", "other", "rule"),
    [
        (48, "q", {"rounds": 2}, "deadline"),
        (40, "q", {"turn": 0}, "goal-order"),
        (40, "q", {"clock": {"since": 8}}, "deadline"),
        (15, "r", {"seen": [0, 1, 2]}, "completed"),
    ],
)
def test_a_header_that_tells_otherwise_breaks_a_rule(
    end: int, robot: str, other: dict[str, object], rule: str
) -> None:
    """The audit counts from what the header tells of the run before."""
    scenario = loaded(DOOR if robot == "q" else ONE % KINDS["cover"])
    run = continued(play(scenario), end, scenario)
    run.records[0]["scenario"]["begun"]["robots"][robot] |= other
    assert rule in run.broken


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
    run = play(scenario)
    for tick in (5, 2):
        ticks = [line.get("tick", 0) for line in run.records]
        rest = resumed(read_lines(run.lines[: ticks.index(tick)]), scenario)
        run = play(rest)
    assert [obstacle.name for obstacle in rest.obstacles] == ["door@6"]
    assert (rest.until.by, [change.at for change in rest.changes]) == (17, [9])
    assert rest.inputs[0].spans == ((25, 25),)
    assert run.outcome["outcome"] == "completed"


CONTINUED = {
    "door": DOOR,
    "orders": ORDERS,
    "closed": CLOSED,
    "alarm": ALARM,
    "back": COMES_BACK,
    "tight": TIGHT % 30,
    "cover": ONE % KINDS["cover"],
    "once": ONE % KINDS["once"],
}


@pytest.mark.parametrize("name", CONTINUED)
def test_the_audit_derives_what_the_header_tells(name: str) -> None:
    """By its own replay of the run before."""
    scenario = loaded(CONTINUED[name])
    lines = play(scenario).lines
    for end in range(2, len(lines) - 1, 3):
        first, begins = read_lines(lines[:end]), Run()
        Mission(resumed(first, scenario), listeners=[begins]).start()
        assert audit(read_lines(begins.lines), first).findings == (), end


@pytest.mark.parametrize(
    ("end", "where", "other", "said"),
    [
        (40, ("begun", "robots", "q", "rounds"), 2, "q begins with 2 rounds, but had 0"),
        (40, ("begun", "robots", "q", "seen"), [], r"targets \[\], but had \[0\]"),
        (40, ("begun", "robots", "q", "turn"), 0, "target 0, but 1 was next"),
        (40, ("begun", "robots", "q", "clock", "since"), 2, "began 3 ticks before, not 2"),
        (24, ("begun", "due"), {}, "is due, but the first run leaves {'door@2'"),
        (24, ("begun", "due", "door@2"), 9, "is due, but the first run leaves"),
        (40, ("begun", "had"), ["d", "q"], "d, q has had a turn of tick 1"),
        (24, ("begun", "asked"), {}, "nothing is requested, but was {'door@2'"),
        (24, ("begun", "asked", "door@2", "q"), 9, "is requested, but was {'door@2'"),
        (40, ("begun", "stays"), ["door@2"], "door@2 stays, but stayed none"),
        (40, ("begun", "closed"), ["door@2"], "door@2 is untraversable, but found was none"),
        (24, ("begun", "waited"), {}, "no robot has stood before, but it was {'d'"),
        (24, ("begun", "waited", "d"), 9, "has stood before, but it was {'d'"),
        (40, ("begun", "trace"), "0" * 64, "continues another trace"),
        (40, ("begun",), None, "does not record that it continues"),
        (40, ("robots", "q", "start"), 0, "q begins at 0"),
        (
            40,
            ("robots", "q", "objective"),
            {"visit": [0, 4]},
            "q has the objective 'visit 0, 4', but had '",
        ),
    ],
)
def test_a_header_that_tells_otherwise_is_found(
    end: int, where: tuple[str, ...], other: object, said: str
) -> None:
    scenario = loaded(DOOR)
    first = read_lines(play(scenario).lines[:end])
    run = play(resumed(first, scenario))
    place = run.records[0]["scenario"]
    for key in where[:-1]:
        place = place[key]
    place[where[-1]] = other
    found = audit(read_lines(run.lines), first).findings
    told = [one.explanation for one in found if one.rule == "continuation"]
    assert any(re.search(said, one) for one in told), told


def test_check_trace_compares_a_rest_with_the_run_before(tmp_path: Path) -> None:
    first, rest = tmp_path / "first.jsonl", tmp_path / "rest.jsonl"
    source = tmp_path / "s.yaml"
    source.write_text(whole(DOOR))
    lines = play(DOOR).lines
    first.write_text("".join(lines[:40]))
    assert warm.safenav("resume", first, source, "--trace", rest, "--no-map").returncode == 0
    assert warm.safenav("check-trace", rest, "--after", first).returncode == 0
    first.write_text("".join(lines[:30]))
    done = warm.safenav("check-trace", rest, "--after", first)
    assert done.returncode == 1
    assert "continuation" in done.stdout


NARROW = """
map: {grid: ["#######", "#..#..#", "#.....#", "#..#..#", "#######"]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: [lift]}}
  obstacles: {beam: {needs: [{action: lift, robots: 2, at: neighbours, together: true}]}}
robots:
  a: {model: cart, start: [2, 1], objective: {visit: [[2, 5], [2, 1]]}}
  b: {model: cart, start: [1, 1], objective: {hold: [1, 1]}}
obstacles: [{type: beam, region: [2, 3]}]
until: {rounds: 1}
"""


def test_a_request_that_was_open_is_part_of_the_first_impasse_of_the_rest() -> None:
    """Only one of the two that must lift the beam has room beside it."""
    run = play(NARROW)
    rest = continued(run, len(run.upto("backtrack")), loaded(NARROW))
    for ended in (run, rest):
        assert ended.outcome["outcome"] == "operator_needed"
        assert "no room for all of them" in ended.outcome["explanation"]
