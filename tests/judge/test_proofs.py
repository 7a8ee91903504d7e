"""Proofs of negatives: sound ones are accepted, false and forged ones get a reason."""

import hashlib
import json
from copy import deepcopy
from typing import Any

import pytest

from judge.trace_script import CORRIDOR, Line, Script, closure, obstacle, robot, text
from safenav.judge.engine import judge

FREE = range(8, 13)
Robots = dict[str, Line]


def reasons(robots: Robots, doors: list[Line], met_by: str, proof: Line, cause: str) -> str:
    """What is wrong with the proof in a run that ends once a robot has met the obstacles."""
    s = Script(CORRIDOR, robots, doors)
    s.next_tick()
    for door in doors:
        s.meet(met_by, door["name"])
        del s.lines[-2:]
    ended = s.end("operator_needed", dict.fromkeys(robots, 0), cause=cause, proof=proof)
    found = judge(text(ended))
    assert found.notes == [] or not found.findings
    return "; ".join(one.explanation for one in (*found.findings, *found.notes))


def changed(proof: Line, *path: Any, to: Any) -> Line:
    found = deepcopy(proof)
    inner: Any = found
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = to
    return found


A: Line = robot("ground", [], 10, {"visit": [12, 8]})
B: Line = robot("air", ["sense"], 9, {"visit": [8, 9]})
DOOR: Line = obstacle("door", 11, "push", [11], ["a", "b"])
NO_PUSHER = closure(["door@11"], a=([8, 9, 10], False), b=([8, 9, 10], True))


@pytest.mark.parametrize(
    ("proof", "reason"),
    [
        (NO_PUSHER, ""),
        (changed(NO_PUSHER, "robots", "a", "poses", to=[[9, None], [10, None]]), "outside its"),
        (changed(NO_PUSHER, "robots", "a", "poses", to=[[8, None], [9, None]]), "begins outside"),
        (changed(NO_PUSHER, "robots", "a", "live", to=True), "proves nothing"),
        (changed(NO_PUSHER, "robots", "b", "live", to=False), "b can continue forever"),
        (changed(NO_PUSHER, "never", to=[]), "omits door@11"),
        (changed(NO_PUSHER, "robots", to={"a": NO_PUSHER["robots"]["a"]}), "not the team"),
    ],
)
def test_a_closure_that_does_not_hold_gets_a_reason(proof: Line, reason: str) -> None:
    found = reasons({"a": A, "b": B}, [DOOR], "a", proof, "no_capable_robot")
    assert reason in found if reason else found == ""


def test_an_obstacle_that_a_robot_can_resolve_is_not_permanent() -> None:
    able, door = (
        B | {"capabilities": ["push"]},
        DOOR | {"needs": [{"action": "push", "regions": [10]}]},
    )
    found = reasons({"a": A, "b": able}, [door], "a", NO_PUSHER, "no_capable_robot")
    assert "can be resolved" in found


WEST: Line = obstacle("west", 9, "push", [11], ["b"])
EAST: Line = obstacle("east", 11, "push", [9], ["b"])


def one_way() -> Line:
    """The one that pushes faces east and cannot turn round, so that only the western obstacle can
    be resolved."""
    after = closure(["east@11"], b=([8, 9, 10], False))
    poses = [[11, "east"], [12, "east"]]
    after["robots"]["a"] = {"poses": poses, "live": False}
    option = {"obstacle": "west@9", "need": 0, "robots": ["a"]}
    return {"kind": "tree", "choices": [{"option": option, "proof": after}]}


@pytest.mark.parametrize(
    ("proof", "reason"),
    [
        (one_way(), ""),
        ({"kind": "tree", "choices": []}, "not refuted"),
        (
            changed(one_way(), "choices", 0, "proof", "robots", "b", "poses", to=[[10, None]]),
            "outside its closure",
        ),
    ],
)
def test_a_tree_refutes_each_choice(proof: Line, reason: str) -> None:
    robots = {
        "a": robot("ground", ["push"], 10, {"visit": [10]}, heading="east"),
        "b": robot("air", [], 10, {"visit": [8, 12]}),
    }
    found = reasons(robots, [WEST, EAST], "b", proof, "unrealizable")
    assert reason in found if reason else found == ""


def joint(robots: Robots, poses: list[list[int]], **stages: int) -> Line:
    each = ([[region, None] for region in one] for one in poses)
    lines = sorted(json.dumps(one, separators=(",", ":")) + "\n" for one in each)
    return {
        "kind": "joint",
        "robots": list(robots),
        "start": {name: [one["start"], None] for name, one in robots.items()},
        "stages": stages,
        "goal": {"rounds": 1},
        "states": len(poses),
        "sha256": hashlib.sha256("".join(lines).encode()).hexdigest(),
    }


ONE, TWO = robot("ground", [], 8, {"visit": [12]}), robot("ground", [], 12, {"visit": [8]})
PASSING: Robots = {"a": ONE, "b": TWO}
ORDERED = [[a, b] for a in FREE for b in FREE if a < b]


@pytest.mark.parametrize(
    ("field", "value", "reason"),
    [
        ("kind", "joint", ""),
        ("states", 9, "reachable than the 9 of"),
        ("states", 11, "10 states are reachable, not 11"),
        ("states", 10**9, "not judged"),
        ("sha256", "0" * 64, "sha256"),
        ("start", {"a": [9, None], "b": [12, None]}, "not where the proof begins"),
        ("robots", [], "no robots"),
    ],
)
def test_robots_that_cannot_pass_each_other_are_in_deadlock(
    field: str, value: Any, reason: str
) -> None:
    proof = changed(joint(PASSING, ORDERED), field, to=value)
    found = reasons(PASSING, [], "a", proof, "deadlock")
    assert reason in found if reason else found == ""


def test_a_team_that_can_complete_is_not_deadlocked() -> None:
    team = {"a": ONE | {"objective": {"visit": [9]}}, "b": TWO | {"objective": {"visit": [11]}}}
    found = reasons(team, [], "a", joint(team, ORDERED), "deadlock")
    assert "the mission can be completed with a at 9" in found


def test_a_proof_that_omits_a_robot_that_could_help_is_refused() -> None:
    team = PASSING | {"c": robot("air", ["push"], 10, {"visit": [10]})}
    door = obstacle("door", 9, "push", [9], ["a", "b"])
    proof = joint(PASSING, ORDERED) | {"stages": {"door@9": 0}}
    assert "c, which the proof omits" in reasons(team, [door], "a", proof, "deadlock")


@pytest.mark.parametrize(
    ("robots", "reason"),
    [
        (["a", "b"], ""),
        (["a", "c"], "there is room at 2 regions for 2 robots"),
        (["a"], "there is room at 1 regions for 1 robots"),
        ([], "names no robots"),
        (["a", "d"], "need not stay at a target, or may share its region"),
    ],
)
def test_robots_without_room_are_counted(robots: list[str], reason: str) -> None:
    team = {
        "a": robot("ground", [], 8, {"hold": 10}),
        "b": robot("ground", [], 12, {"hold": 10}),
        "c": robot("ground", [], 11, {"hold": 11}),
        "d": robot("air", [], 11, {"visit": [10]}),
    }
    found = reasons(team, [], "a", {"kind": "room", "robots": robots}, "deadlock")
    assert reason in found if reason else found == ""
