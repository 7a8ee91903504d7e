"""Effects of raw formulas on the graph of a robot: allowed steps, goals, memory."""

import pytest
from msgspec.structs import replace

from safenav.errors import UsageError
from safenav.outcome import Outcome
from safenav.runtime.run.mission import Mission
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.model import Robot, RobotModel
from safenav.scenario.objective import Ltl
from safenav.scenario.reading.loader import load_scenario_text
from safenav.team.formulas import StateGraph, graph_of, targets_of
from safenav.trace.records import Move, Record, Resolved
from safenav.world.map import Heading, RegionMap
from safenav.world.moves import Mobility, Pose
from safenav.world.poses import PoseGraph, bits

WORLD = RegionMap.from_grid(["######", "#....#", "######"])  # regions 7 8 9 10
BOOL = {"seen": None}


def graph(
    mobility: Mobility = Mobility.FREE, *, shared: bool = False, **body: object
) -> tuple[PoseGraph, tuple[int, ...]]:
    """The graph of a robot with formulas, and where it meets its goals."""
    objective = replace(Ltl(), **body)  # type: ignore[arg-type]
    model = RobotModel("bird", mobility, "air", frozenset())
    heading = Heading.EAST if mobility is Mobility.HEADING else None
    robot = Robot("bee", model, Pose(7, heading), objective)
    found = graph_of(robot, WORLD, shared=shared)
    return found, targets_of(objective, found)


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
def test_safety_formulas_close_exactly_the_steps_that_they_forbid(
    safety: tuple[str, ...], memory: dict[str, None], closed: set[tuple[int, int]]
) -> None:
    found, _ = graph(safety=safety, memory=memory)
    plain = PoseGraph(WORLD, Mobility.FREE)
    assert {(p, q) for p in WORLD.free for q in plain.steps(p) if q not in found.steps(p)} == closed
    assert found.one_way is bool(closed)


@pytest.mark.parametrize("shared", [False, True])
@pytest.mark.parametrize("mobility", Mobility)
def test_forward_and_backward_masks_agree_with_single_steps(
    mobility: Mobility, shared: bool
) -> None:
    here = "heading = 1 & region = 8" if mobility is Mobility.HEADING else "region = 8"
    memory = BOOL if shared else {}
    safety = (f"{here} -> region' != 9", "region' != 7")
    found, _ = graph(mobility, shared=shared, safety=safety, memory=memory)
    assert isinstance(found, StateGraph) is shared
    poses = list(bits(found.everywhere))
    steps = {(p, q) for p in poses for q in found.steps(p)}
    assert {(p, q) for p in poses for q in bits(found.forward(1 << p))} == steps
    assert {(p, q) for q in poses for p in bits(found.backward(1 << q))} == steps


@pytest.mark.parametrize("shared", [False, True])
@pytest.mark.parametrize(
    ("goal", "regions", "kept"),
    [
        pytest.param("region = 8", {8}, {8}, id="now"),
        pytest.param("region' = 8", {8}, {8}, id="next"),
        pytest.param("region = 8 | region' = 10", {8, 10}, {8, 10}, id="either"),
        pytest.param("region = 8 & region' = 9", {9}, set(), id="a step"),
    ],
)
def test_regions_in_which_a_goal_is_met(
    goal: str, regions: set[int], kept: set[int], shared: bool
) -> None:
    found, goals = graph(shared=shared, liveness=(goal,))
    reached = found.closure(1 << found.number(Pose(7)), found.everywhere)
    assert [set(bits(found.regions_of(mask & reached))) for mask in goals] == [regions]
    if isinstance(found, StateGraph):
        assert [set(bits(found.regions_of(mask))) for mask in found.stays] == [kept]


def test_a_state_remembers_what_the_formulas_say() -> None:
    safety = ("seen' <-> seen | region = 8", "seen -> !(region' = 8)")
    found, (goal,) = graph(
        shared=True, safety=safety, memory=BOOL, init=("!seen",), liveness=("seen & region = 10",)
    )
    state, walk = found.number(Pose(7)), [8, 9, 10]
    for region in walk:
        assert found.memory(state) == {"seen": int(region > 9)} or region == 9
        (state,) = (step for step in found.steps(state) if step % WORLD.size == region)
    assert found.memory(state) == {"seen": 1} and goal >> state & 1
    (state,) = found.steps(state)  # back to 9, and from there it must not enter 8 again
    assert [step % WORLD.size for step in found.steps(state)] == [10]


def test_too_many_states_of_a_robot_that_shares_its_floor_are_refused() -> None:
    memory = {"n": (0, 2000)}
    graph(memory=memory)
    with pytest.raises(UsageError, match=r"robots\.bee\.objective: .* more than 4000 states"):
        graph(shared=True, memory=memory)


def test_formulas_constrain_headings() -> None:
    found = guarantees_of(Ltl(safety=("heading = 1 -> heading' = 1",)))
    east = Pose(8, Heading.EAST)
    assert found.remembered({}, east, Pose(9, Heading.EAST)) == {}
    assert found.remembered({}, east, Pose(8, Heading.NORTH)) is None


ALARM = """
safenav: 1
map: {grid: ["######", "#....#", "######"]}
catalogue: {robots: {free: {mobility: free, layer: ground, capabilities: []}}}
robots:
  a:
    model: free
    start: 7
    objective: {ltl: {liveness: [region = 9], safety: ["alarm' -> region' = region"]}}
  b: {model: free, start: 10, objective: {hold: 10}}
inputs: {alarm: {at: [1-9], always_eventually: off}}
until: {rounds: 1}
"""


def test_inputs_hold_a_robot_that_follows_a_joint_plan() -> None:
    lines = list[Record]()
    result = Mission(load_scenario_text(ALARM), listeners=[lines.append]).run()
    steps = [x.tick for x in lines if isinstance(x, Move) and x.robot == "a" and x.to != x.from_]
    assert (result.outcome, steps) == (Outcome.COMPLETED, [10, 11])


def test_a_request_for_which_the_memory_leaves_no_strategy_is_set_aside() -> None:
    text = """
safenav: 1
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
orders: [{type: box, region: 0, at: 2}, {type: parcel, region: 4, at: 3}]
until: {rounds: 1}
"""
    lines = list[Record]()
    result = Mission(load_scenario_text(text), listeners=[lines.append]).run()
    done = [line.obstacle for line in lines if isinstance(line, Resolved)]
    assert (result.outcome, done) == (Outcome.COMPLETED, ["box@0"])
