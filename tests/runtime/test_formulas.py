"""Effects of raw formulas on a robot: allowed steps, poses of goals, memory."""

import json

import pytest
from msgspec.structs import replace

from runtime.played import completed, play
from safenav.audit.check import check_trace
from safenav.runtime.formulas import Formulas
from safenav.scenario.objective import Ltl
from safenav.world.map import Heading, RegionMap
from safenav.world.moves import Mobility, Pose
from safenav.world.poses import PoseGraph, bits

WORLD = RegionMap.from_grid(["######", "#....#", "######"])  # regions 7 8 9 10
BOOL = {"seen": None}


def read(mobility: Mobility = Mobility.FREE, **body: object) -> Formulas:
    return Formulas(replace(Ltl(), **body), WORLD, mobility)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("safety", "memory", "closed"),
    [
        pytest.param((), {}, set(), id="nothing"),
        pytest.param(("region' != 9",), {}, {(8, 9), (10, 9)}, id="a zone"),
        pytest.param(("region = 8 -> region' != 9",), {}, {(8, 9)}, id="one way"),
        pytest.param(("region = 8 -> X(region = 8 | region = 7)",), {}, {(8, 9)}, id="next"),
        pytest.param(("seen -> region' != 9",), BOOL, set(), id="with some memory"),
        pytest.param(
            ("seen -> region' != 9", "region = 8 -> seen"), BOOL, {(8, 9)}, id="with no memory"
        ),
    ],
)
def test_steps_that_are_closed(
    safety: tuple[str, ...], memory: dict[str, None], closed: set[tuple[int, int]]
) -> None:
    graph = read(safety=safety, memory=memory).graph
    plain = PoseGraph(WORLD, Mobility.FREE)
    found = {(p, q) for p in WORLD.free for q in plain.steps(p) if q not in graph.steps(p)}
    assert found == closed
    assert graph.one_way is bool(closed)


@pytest.mark.parametrize("mobility", Mobility)
def test_masks_agree_with_single_steps(mobility: Mobility) -> None:
    here = "heading = 1 & region = 8" if mobility is Mobility.HEADING else "region = 8"
    safety = (f"{here} -> region' != 9", "region' != 7")
    graph = read(mobility, safety=safety).graph
    poses = list(bits(graph.everywhere))
    steps = {(p, q) for p in poses for q in graph.steps(p)}
    assert {(p, q) for p in poses for q in bits(graph.forward(1 << p))} == steps
    assert {(p, q) for q in poses for p in bits(graph.backward(1 << q))} == steps
    assert graph.forward(graph.everywhere) == sum(1 << q for q in {q for _, q in steps})
    assert graph.backward(graph.everywhere) == sum(1 << p for p in {p for p, _ in steps})


@pytest.mark.parametrize(
    ("goal", "regions", "stays"),
    [
        pytest.param("region = 8", {8}, True, id="now"),
        pytest.param("region' = 8", {8}, True, id="next"),
        pytest.param("region = 8 | region' = 10", {8, 10}, True, id="either"),
        pytest.param("region = 8 & region' = 9", {9}, False, id="a step"),
        pytest.param("seen & region = 8", {8}, False, id="with memory"),
    ],
)
def test_places_of_goals(goal: str, regions: set[int], stays: bool) -> None:
    formulas = read(liveness=(goal,), memory=BOOL if "seen" in goal else {})
    assert [set(bits(mask)) for mask in formulas.goals] == [regions]
    assert formulas.met_by_staying is stays


@pytest.mark.parametrize(
    ("memory", "step", "after"),
    [
        ({"seen": 0}, (8, 9), {"seen": 1}),
        ({"seen": 1}, (9, 10), {"seen": 1}),
        ({"seen": 0}, (9, 10), {"seen": 0}),
        ({"seen": 1}, (9, 8), None),
        ({}, (9, 8), {"seen": 0}),
    ],
)
def test_what_is_remembered_after_a_step(
    memory: dict[str, int], step: tuple[int, int], after: dict[str, int] | None
) -> None:
    formulas = read(safety=("seen' <-> seen | region = 8", "seen -> !(region' = 8)"), memory=BOOL)
    assert formulas.guarantees.remembered(memory, Pose(step[0]), Pose(step[1])) == after


def test_headings_count() -> None:
    formulas = read(Mobility.HEADING, safety=("heading = 1 -> heading' = 1",))
    assert formulas.guarantees.remembered({}, Pose(8, Heading.EAST), Pose(9, Heading.EAST)) == {}
    assert formulas.guarantees.remembered({}, Pose(8, Heading.EAST), Pose(8, Heading.NORTH)) is None


BEHIND = """\
map: {grid: ["#####", "#...#", "#####"]}
robots:
  a:
    model: quadcopter
    start: 7
    objective:
      ltl: {memory: {m: bool}, init: "!m", safety: "m' <-> m | region = 6",
            liveness: "m & region = 7"}
  b: {model: quadcopter, start: 6, objective: {hold: 6}}
until: {rounds: 1}
"""


def test_a_deadlock_that_only_memory_reveals_is_proven(clock: str) -> None:
    """a stands on its target, but has to have been behind b; they cannot change places, and have
    three ways to stand in the corridor. Without the memory that would be no proof."""
    run = play(f"{BEHIND}clock: {clock}\n")
    proof = run.outcome["proof"]
    assert (run.outcome["cause"], proof["states"]) == ("deadlock", 3)
    assert proof["memory"] == {"a": {"m": 0}}
    wrong = [
        ({"a": {"m": 1}}, "cannot remember"),
        ({"a": {"n": 0}}, "do not remember"),
        ({"b": {"m": 0}}, "do not remember"),
        (None, "can be completed"),
    ]
    for told, said in wrong:
        proof["memory"] = told
        assert said in str(run.findings)


EVEN = """\
map: {grid: ["....."]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: [lift], timing: 2}}
  obstacles: {parcel: {action: lift, resolve_at: self, blocks: []}}
robots:
  a:
    model: cart
    start: 0
    objective:
      ltl: {memory: {m: bool}, init: "!m", liveness: ["region = 0 & m", "region = 4 & !m"],
            safety: ["region' = 2 & region != 2 -> (m' <-> !m)",
                     "!(region' = 2 & region != 2) -> (m' <-> m)"]}
orders: [{type: parcel, region: 3, at: 4}]
"""


def test_a_strategy_that_comes_in_transit_remembers_the_step(clock: str) -> None:
    """The robot counts how often it enters region 2, and is on its way there when an order gives it
    another strategy."""
    run = completed(f"{EVEN}clock: {clock}\n")
    new, *_ = run.all("synthesis", reason="request")
    assert (new["region"], new["memory"]) == (2, {"m": 1})
    new["memory"] = {"m": 0}
    assert "cannot remember" in str(run.findings)


NO_LONGER = """\
map: {grid: ["....."]}
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: [lift]}}
  obstacles: {parcel: {action: lift, blocks: []}, box: {action: lift, blocks: []}}
robots:
  a:
    model: cart
    start: 2
    objective:
      ltl: {memory: {m: bool}, init: "!m", liveness: region = 2,
            safety: ["m' <-> m | region = 2", "m -> region' != 4"]}
orders: [{type: parcel, region: 4, at: 2}, {type: box, region: 0, at: 3}]
order: oldest
until: {rounds: 1}
"""


def test_each_decision_records_the_request_for_which_no_strategy_exists(clock: str) -> None:
    """The robot no longer goes where the parcel is, so it serves the later order."""
    run = play(f"{NO_LONGER}clock: {clock}\n")
    refused = run.all("synthesis", verdict="unrealizable")
    asked = run.all("request", obstacle="parcel@4")
    assert len(asked) == len(refused) == 3
    assert run.one("request", obstacle="box@0")["helper"] == "a"
    run.records.remove(asked[1])
    run.records.remove(refused[1])
    assert "a helps with box@0, but the rules choose no robot" in run.findings


BEAM = """
map: {grid: ["....", "...."]}
catalogue:
  robots:
    slow: {mobility: free, layer: ground, capabilities: [lift], timing: 3}
    quick: {mobility: free, layer: air, capabilities: [lift]}
  obstacles: {beam: {needs: [{action: lift, robots: 2, at: [1], together: true}], blocks: [air]}}
robots:
  a: {model: slow, start: 4, objective: {ltl: {liveness: "region = 7"}}}
  b:
    model: quick
    start: 2
    objective:
      ltl: {liveness: ["region = 0", "region = 3"], safety: "region = %s -> region' != %s"}
obstacles: [{type: beam, region: 0}]
until: {rounds: 1}
"""


@pytest.mark.parametrize(("left", "waits"), [(5, True), (1, False)])
def test_a_helper_with_formulas_waits_for_the_other(left: int, waits: bool) -> None:
    """Where both are needed together, unless its formulas forbid it to stay there."""
    run = completed(BEAM % (left, left))
    met = run.one("resolved")["tick"]
    assert ({*run.path("b")[2 : met - 1]} == {1}) is waits


def test_where_formulas_forbid_to_wait_is_noted(clock: str) -> None:
    """``b`` could open the gate, but the formulas of ``a`` forbid it to wait for that at 6."""
    run = play(f"""
        clock: {clock}
        map: {{grid: ["#####", "#...#", "#...#", "#####"]}}
        catalogue:
          robots:
            bird: {{mobility: free, layer: air, capabilities: []}}
            cart: {{mobility: free, layer: ground, capabilities: [push]}}
          obstacles: {{gate: {{action: push, blocks: [bird]}}}}
        robots:
          a:
            model: bird
            start: 6
            objective: {{ltl: {{liveness: "region = 8", safety: "region' != 6"}}}}
          b: {{model: cart, start: 13, objective: {{hold: 13}}}}
        obstacles: [{{type: gate, region: 7}}, {{type: gate, region: 11}}]
        until: {{rounds: 1}}
        """)
    assert (run.outcome["outcome"], run.outcome["cause"]) == ("operator_needed", "unrealizable")
    (note,) = check_trace(map(json.dumps, run.records)).notes
    assert note.explanation == "not judged: whether a could go where its formulas let it stay"
    run.records[:] = [line for line in run.records if line.get("verdict") != "unrealizable"]
    assert "but that is not proven" in run.findings
