"""Strict ordered patrolling: the targets in order, forever, and none touched out of its turn."""

import json
import re
import textwrap
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest

from certify.making import CIRCUIT, bundle_at, certified, files_of, judged, rewrite, shipped
from runtime.played import Line, Run, completed, play
from safenav.audit.check import check_trace

SHARED = """
map: {grid: ["########", "#......#", "#......#", "#......#", "########"]}
catalogue: {robots: {cart: {mobility: free, layer: ground, capabilities: []}}}
robots:
  a: {model: cart, start: [1, 1], objective: {circuit: [[1, 6], [3, 6], [3, 1]]}}
  b: {model: cart, start: [3, 6], objective: {circuit: [[1, 1], [2, 3]]}}
until: {rounds: 3}
"""
ALONE = """
map: {grid: ["########", "#......#", "#......#", "#......#", "########"]}
catalogue:
  robots:
    cart:
      {mobility: free, layer: ground, capabilities: [], motion: disc, speed: 1,
       battery: {capacity: 20, move: 1, stay: 0, charge: 4}}
robots:
  a: {model: cart, start: [1, 1], objective: {circuit: [[1, 6], [3, 6], [3, 1]], within: 14}}
chargers: [[2, 1]]
"""
CHARGER = 17


def strict(path: list[int], targets: list[int]) -> bool:
    """Whether a walk touches the targets one after the other, each for one tick only."""
    met = [(tick, targets.index(r)) for tick, r in enumerate(path) if r in targets]
    return all(after[1] == (before[1] + 1) % len(targets) for before, after in pairwise(met))


def test_targets_are_met_in_strict_order_also_after_helping() -> None:
    trace = completed(CIRCUIT)
    begun = {name: trace.all("synthesis", robot=name)[-1]["tick"] for name in ("quad", "digit")}
    for robot, targets in (("quad", [54, 49, 37]), ("digit", [58, 28, 20])):
        assert strict(trace.path(robot)[begun[robot] :], targets)
        assert trace.all("synthesis", robot=robot)[-1].get("form") in (None, "literal")


def met_in_order(trace: Run, robot: str, count: int) -> bool:
    """Whether its goals follow each other; a charger is not a target."""
    met = (goal for goal in trace.all("goal", robot=robot) if goal["region"] != CHARGER)
    return all(b == (a + 1) % count for a, b in pairwise(goal["goal"] for goal in met))


@pytest.mark.parametrize(
    ("text", "more"),
    [
        (SHARED, ""),
        (SHARED, "clock: live\n"),
        (SHARED, "coordination: assignable\n"),
        (ALONE, ""),
    ],
    ids=["shared", "live", "assignable", "energy and deadlines"],
)
def test_it_is_met_in_order_under_other_demands(text: str, more: str) -> None:
    trace = completed(text + more)
    assert met_in_order(trace, "a", 3)
    if text == SHARED:
        assert {s["form"] for s in trace.all("synthesis", robot="a")} == {"alternation"}


HALL = """
map: {{grid: ["######", "#...##", "#....#", "#....#", "#..###", "#..#.#", "#....#", "######"]}}
robots:
  r:
    model: digit
    start: [5, 1]
    heading: north
    objective: {{circuit: {targets}, form: literal, within: {within}}}
"""


@pytest.mark.parametrize(
    ("targets", "within", "says"),
    [
        ("[[4, 2], [3, 1], [4, 1], [1, 2]]", 17, "'form: literal' forbids crossing"),
        ("[[3, 1], [1, 2], [3, 4]]", 9, "the fastest round takes 10"),
        ("[[3, 1], [1, 2], [3, 4]]", 10, "every robot has met its objective"),
    ],
)
def test_rounds_in_strict_order_are_promised_or_refused(
    targets: str, within: int, says: str
) -> None:
    """The audit agrees on the least number of ticks."""
    assert says in play(HALL.format(targets=targets, within=within)).outcome["explanation"]


BEYOND = """
map: {grid: ["########", "#......#", "########"]}
catalogue:
  robots:
    rover: {mobility: free, layer: ground, capabilities: [], battery: {capacity: 14, charge: 5}}
robots:
  r: {model: rover, start: [1, 3], objective: {patrol: [[1, 6], [1, 3]], form: literal}}
chargers: [[1, 1]]
until: {rounds: 4}
"""


def test_a_literal_form_that_is_lost_beyond_a_target_is_proven_lost() -> None:
    """The robot went to charge across the target that is not next, and cannot come back."""
    run = play(BEYOND)
    lines = run.records
    assert (lines[-1]["outcome"], lines[-1]["cause"]) == ("operator_needed", "unrealizable")
    lines[-2]["memory"] = {"scout": 1}  # from there it could
    assert run.broken == {"proof"}


def _move(lines: list[Line], robot: str, tick: int) -> Line:
    found = (m for m in lines if m["type"] == "move" and (m["robot"], m["tick"]) == (robot, tick))
    return next(found)


def skip_a_target(lines: list[Line]) -> None:
    goals = [k for k, line in enumerate(lines) if line["type"] == "goal" and line["robot"] == "a"]
    del lines[goals[2]]


def swap_two_goals(lines: list[Line]) -> None:
    first, second, *_ = (line for line in lines if line["type"] == "goal" and line["robot"] == "a")
    first["goal"], second["goal"] = second["goal"], first["goal"]


def touch_one_out_of_turn(lines: list[Line]) -> None:
    lines[0]["scenario"]["robots"]["a"]["objective"]["circuit"][1] = 12


def wait_at_a_target(lines: list[Line]) -> None:
    goal = next(line for line in lines if line["type"] == "goal" and line["robot"] == "a")
    _move(lines, "a", goal["tick"] + 1).update({"to": goal["region"]})
    _move(lines, "a", goal["tick"] + 2).update({"from": goal["region"]})


@pytest.mark.parametrize(
    "alter", [skip_a_target, swap_two_goals, touch_one_out_of_turn, wait_at_a_target]
)
def test_a_trace_that_does_it_otherwise_is_refused(alter: Callable[[list[Line]], None]) -> None:
    run = play(SHARED[: SHARED.index("  b:")] + "until: {rounds: 2}\n")
    alter(run.records)
    assert run.findings


def test_a_bundle_proves_it() -> None:
    status, said = judged(shipped("circuit"))
    assert status == 0, said
    claims = re.findall(r"form-\d+: (.*)", said)
    assert len(claims) == 2 and all("without crossing" in claim for claim in claims)


@pytest.mark.parametrize(
    ("kind", "before", "after"),
    [
        ("circuit", r"circuit(\W+)54,(\s*)49,(\s*)37", r"circuit\g<1>54,\g<2>37,\g<3>49"),
        ("visit", r"visit(\W+54,\s*49,\s*37)", r"circuit\1"),
        ("circuit", r"circuit(\W+58,\s*28,\s*20)", r"round\1"),
    ],
    ids=["another order", "strategies that may cross", "an unknown kind"],
)
def test_a_bundle_is_refused_whose_strategies_keep_less(
    kind: str, before: str, after: str, tmp_path: Path
) -> None:
    text = CIRCUIT.replace("circuit: [54", f"{kind}: [54")
    bundle = shipped("circuit") if kind == "circuit" else bundle_at("visiting", text)
    files = files_of(bundle)
    for name in ("scenario.json", "trace.jsonl"):
        told, changes = re.subn(before, after, files[name].decode())
        assert changes
        files[name] = told.encode()
    assert judged(rewrite(bundle, files, tmp_path))[0] == 1


def test_a_literal_objective_lost_among_others_is_noted_and_certified(clock: str) -> None:
    text = f"""
        clock: {clock}
        map: {{grid: ["######", "#....#", "#....#", "######"], resolution: 1}}
        robots:
          a: {{model: quadcopter, start: 7, objective: {{patrol: [7, 10], form: literal}}}}
          b: {{model: quadcopter, start: 13, objective: {{visit: [13, 16]}}}}
        obstacles: [{{type: door, region: 9}}]
        """
    run = play(text)
    assert (run.outcome["outcome"], run.outcome["cause"]) == ("operator_needed", "unrealizable")
    (note,) = check_trace(map(json.dumps, run.records)).notes
    assert note.explanation.startswith("not judged: whether others or inputs can keep a")
    said = certified(textwrap.dedent(text))
    assert "there is no strategy for a" in said
    assert "Not judged: whether others or inputs can keep a" in said
    run.records[:] = [line for line in run.records if line.get("verdict") != "unrealizable"]
    assert "but that is not proven" in run.findings
