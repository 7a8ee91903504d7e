"""A finite task: each target once, in order, then the robot stays at the last one."""

import re
from collections.abc import Callable

import pytest

from certify.making import certified
from once import SCENARIOS
from runtime.played import Line, completed, loaded, play
from safenav.errors import InputError
from safenav.runtime.traffic import budgets

CASE_STUDY_1 = (SCENARIOS / "case_study_1.yaml").read_text().split("expect:")[0]
ROOMS = CASE_STUDY_1.replace("patrol: [54, 49]", "once: [54, 49, 37]").replace("patrol", "once")
DEAD_END = """
map: {grid: ["#########", "#.......#", "#.#####.#", "#.#####.#", "#########"]}
robots:
  digit: {model: digit, start: [1, 3], heading: east, objective: {once: [[1, 5], [3, 7]]}}
until: {rounds: 3}
"""


@pytest.mark.parametrize("coordination", ["resynthesis", "assignable"])
def test_targets_are_met_once_in_order_also_after_helping(coordination: str) -> None:
    trace = completed(f"{ROOMS}coordination: {coordination}\n")
    for robot, targets in (("quad", [54, 49, 37]), ("digit", [58, 28])):
        path = trace.path(robot)
        assert path[-1] == targets[-1]
        met = [path.index(target) for target in targets[:-1]]
        assert met == sorted(met)
    assert [g["goal"] for g in trace.all("goal", robot="quad") if g["region"] != 46] == [0, 1, 2]


def test_a_robot_may_end_where_it_cannot_turn_round() -> None:
    trace = completed(DEAD_END)
    assert trace.path("digit")[-3:] == [34, 34, 34]  # each tick there is a round
    ended = play(f"{DEAD_END}coordination: assignable\n").outcome
    assert ended["outcome"] == "unrealizable"
    assert "must be able to leave 34 [3, 7] again; with 'resynthesis' it" in ended["explanation"]
    with pytest.raises(InputError, match="cannot visit all targets infinitely often"):
        loaded(DEAD_END.replace("once", "visit"))


@pytest.mark.parametrize(
    ("targets", "says"),
    [
        ("[]", "is empty"),
        ("[[3, 7], [1, 5]]", "in this order"),
        ("[{any: [12, 13]}, 13]", "the last two targets share region 13"),
    ],
)
def test_what_cannot_be_done_once_is_refused(targets: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        loaded(DEAD_END.replace("[[1, 5], [3, 7]]", targets))


def skip_a_target(lines: list[Line]) -> None:
    goal = next(k for k, line in enumerate(lines) if line["type"] == "goal" and line["goal"] == 0)
    del lines[goal]


def leave_the_last(lines: list[Line]) -> None:
    moves = [line for line in lines if line["type"] == "move"]
    moves[-1].update({"to": 16 + 9, "heading": "north"})


def end_too_early(lines: list[Line]) -> None:
    moves = [k for k, line in enumerate(lines) if line["type"] == "move"]
    del lines[moves[-1]]
    lines[-1].update({"tick": lines[-1]["tick"] - 1, "ticks": lines[-1]["ticks"] - 1})


@pytest.mark.parametrize("alter", [skip_a_target, leave_the_last, end_too_early])
def test_a_trace_that_does_it_otherwise_is_refused(alter: Callable[[list[Line]], None]) -> None:
    run = play(DEAD_END)
    alter(run.records)
    assert run.findings


@pytest.mark.parametrize("text", [ROOMS, DEAD_END], ids=["rooms", "dead end"])
def test_a_bundle_proves_it(text: str) -> None:
    (*_, said) = re.findall(r"form-\d+: (.*)", certified(text))
    assert said.endswith("once, in this order, and stay at the last.")


TRAPPED_HELPER = """
# r1 could enter the bar and look, but would then be unable to turn back to its own target.
map: {grid: ["#######", "#.....#", "#######"], resolution: 1}
catalogue:
  robots:
    m0: {mobility: free, layer: ground, motion: disc, speed: 1}
    m1: {mobility: heading, layer: ground, capabilities: [look], motion: disc, speed: 1}
  obstacles: {bar: {action: look}}
robots:
  r0: {model: m0, start: 12, objective: {once: [10, 12]}}
  r1: {model: m1, start: 8, heading: east, objective: {once: [9]}}
obstacles: [{type: bar, region: 10}]
until: {rounds: 1}
"""
TWO_TO_LIFT = """
# r1 could lift with r0 only beyond r0, which it cannot pass
map: {grid: ["######", "#....#", "######"], resolution: 1}
catalogue:
  robots: {m: {mobility: free, layer: ground, capabilities: [lift], motion: disc, speed: 1}}
  obstacles:
    bar: {needs: [{action: lift, robots: 2, at: neighbours, together: true}], blocks: [r0]}
robots:
  r0: {model: m, start: 9, objective: {once: [10, 9]}}
  r1: {model: m, start: 7, objective: {hold: 10}}
obstacles: [{type: bar, region: 10}]
until: {rounds: 1}
"""
NO_RETURN = """
# with assignable goals it must be able to leave 6 again
coordination: assignable
map: {grid: ["#####", "#...#", "#...#", "#...#", "#####"], resolution: 1}
catalogue:
  robots:
    m0: {mobility: heading, layer: ground, motion: disc, speed: 1}
    m1: {mobility: free, layer: ground, capabilities: [look], motion: disc, speed: 1}
  obstacles: {t0: {action: look, resolve_at: neighbours, has_truth: true}}
robots:
  r0: {model: m0, start: 16, heading: west, objective: {once: [17, 6]}, avoids: [r1]}
  r1: {model: m1, start: 6, objective: {patrol: [13, 18], avoid: [8]}}
never_together: [{robots: [r1, r0], in: [6, 11]}]
obstacles: [{type: t0, region: 7, traversable: false}]
until: {rounds: 1}
"""


@pytest.mark.parametrize(
    ("text", "cause", "said"),
    [
        (TRAPPED_HELPER, "deadlock", "r0 cannot visit 10, 12 once and stay there"),
        (TWO_TO_LIFT, "deadlock", "r0 cannot visit 10, 9 once and stay there"),
        (NO_RETURN, "unrealizable", "with 'resynthesis' it may end there"),
    ],
    ids=["a helper would be trapped", "no room to lift", "no return"],
)
def test_what_no_order_of_moves_completes_is_proven(
    clock: str, text: str, cause: str, said: str
) -> None:
    trace = play(f"{text}clock: {clock}\n")
    assert (trace.outcome["outcome"], trace.outcome["cause"]) == ("operator_needed", cause)
    assert said in trace.outcome["explanation"]
    assert ("none of the" in trace.outcome["explanation"]) == (cause == "deadlock")
    if cause == "deadlock":
        trace.outcome["proof"]["states"] += 1
        assert "proof" in trace.broken
        del trace.outcome["proof"]
        assert "but that is not proven" in trace.findings


def test_a_bundle_proves_that_no_order_of_moves_completes() -> None:
    said = "no order of moves of r0 and r1 completes the mission"
    assert f"An operator is needed: {said}" in certified(TRAPPED_HELPER)


def test_what_is_not_shown_in_the_budget_is_no_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(budgets, "PROOF_BUDGET", 1)
    assert play(TRAPPED_HELPER).outcome["outcome"] == "search_limit"


POCKET = """
map:
  grid: |
    #############
    #....#......#
    #...........#
    #....#......#
    #.##.########
    #.##.########
    #############
catalogue:
  robots:
    walker: {mobility: heading, layer: ground, capabilities: [press]}
    cart: {mobility: free, layer: low}
  obstacles: {gate: {action: press, resolve_at: [[5, 4]]}}
robots:
  w: {model: walker, start: [3, 2], heading: east, objective: {once: TARGETS}}
  c: {model: cart, start: [2, 3], objective: {visit: [[2, 3], [2, 8]]}}
obstacles: [{type: gate, region: [2, 5]}]
until: {rounds: 1}
"""


@pytest.mark.parametrize(
    ("targets", "first"),
    [
        ("[[1, 1], [5, 4]]", [0]),
        ("[[1, 1], [3, 3], [5, 4]]", [0, 1]),
        ("[[3, 4], [5, 4]]", []),
        ("[[5, 4]]", []),
    ],
    ids=["one", "two", "on its way", "none"],
)
def test_a_robot_first_meets_the_targets_to_which_it_cannot_come_back(
    targets: str, first: list[int], clock: str
) -> None:
    """The walker cannot turn round where it opens the gate: it went there first, and could meet its
    other targets no longer."""
    run = completed(POCKET.replace("TARGETS", targets) + f"clock: {clock}\n")
    kinds = [line for line in run.records if line["type"] in ("goal", "resolved")]
    before = kinds[: kinds.index(run.one("resolved", robot="w"))]
    assert {*first} <= {line["goal"] for line in before if line["robot"] == "w"}
    assert run.all("request")[0]["helper"] == "w"
