"""Coordination as in Section V of the paper: order, stack, safe behaviour, waiting; its audit."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from once import SCENARIOS
from runtime.played import Run, completed, play
from safenav.audit.check import check_trace
from safenav.audit.rules import proofs
from safenav.certify.checker.check import open_bundle
from safenav.certify.checker.check_run import Evidence
from safenav.certify.record import bundle_of_trace
from safenav.cli.check_trace import command

DOORS = """
name: two doors and one robot that opens them
map:
  grid: |
    #############
    #...........#
    #...#...#...#
    #############
  names: {west: [2, 3], east: [2, 9]}
catalogue:
  robots:
    seer: {mobility: free, layer: air, capabilities: [], timing: 1}
    pusher: {mobility: free, layer: ground, capabilities: [push]}
  obstacles:
    hatch: {action: push, resolve_at: neighbours}
robots:
  one: {model: seer, start: [2, 1], objective: {visit: [west, [2, 1]]}}
  two: {model: seer, start: [1, 11], objective: {visit: [east, [1, 11]]}}
  opener: {model: pusher, start: [1, 7], objective: {hold: [1, 7]}}
obstacles: [{type: hatch, region: west}, {type: hatch, region: east}]
until: {rounds: 1}
"""

WAITING = """
name: the cart stands in the corridor through which help comes
map:
  grid: |
    ###############
    #...####......#
    #.............#
    #...####......#
    ###############
catalogue:
  robots: {cart: {mobility: free, layer: ground, capabilities: []}}
robots:
  cart: {model: cart, start: [2, 1], objective: {visit: [[2, 12], [2, 1]]}}
  digit: {model: digit, start: [1, 1], heading: east, objective: {visit: [[1, 1], [3, 3]]}}
obstacles: [{type: door, region: [2, 6]}]
until: {rounds: 1}
"""


def findings(trace: Run, change: Callable[[list[dict[str, Any]]], None]) -> list[tuple[str, str]]:
    """Rule and robot of each finding in a trace after a change."""
    lines = json.loads(json.dumps(trace.records))
    change(lines)
    found = check_trace([json.dumps(line) for line in lines]).findings
    return [(finding.rule, finding.robot or "") for finding in found]


def told(kind: str, nth: int, **objectives: object) -> Callable[[list[dict[str, Any]]], None]:
    """Change the objectives of the ``nth`` push or pop, and of the syntheses that follow it."""

    def change(lines: list[dict[str, Any]]) -> None:
        start = [i for i, line in enumerate(lines) if line["type"] == kind][nth]
        lines[start]["objectives"].update(objectives)
        for line in lines[start:]:
            if line["tick"] == lines[start]["tick"] and line["type"] == "synthesis":
                line["objective"] = objectives.get(line["robot"], line["objective"])

    return change


@pytest.mark.parametrize(("order", "helper"), [("newest", "opener"), ("oldest", None)])
def test_the_newest_request_is_served_first(order: str, helper: str | None) -> None:
    trace = completed(f"{DOORS}order: {order}\n")
    first, second = trace.all("request")[:2]
    assert first["helper"] == "opener"
    assert second["helper"] == helper

    def another_order(lines: list[dict[str, Any]]) -> None:
        lines[0]["scenario"]["order"] = {"newest": "oldest", "oldest": "newest"}[order]

    assert ("helper", "opener") in findings(trace, another_order)


def test_a_pop_restores_the_objective_that_was_pushed() -> None:
    trace = play((SCENARIOS / "case_study_3.yaml").read_text())
    restored = trace.one("pop", obstacle="door@47")["objectives"]["quad"]
    assert restored == trace.all("push")[0]["objectives"]["quad"] == {"visit": [[42, 44], 22]}
    other = {"visit": [[42, 44], 48]}
    assert ("pop", "quad") in findings(trace, told("pop", 0, quad=other))


def test_the_requester_leaves_its_helpers_way_at_once() -> None:
    """The door was resolved at tick 49 when the requester stayed until the helper starved."""
    trace = completed(WAITING)
    (push,) = trace.all("push")
    assert push["objectives"]["cart"]["hold"] not in (35, 34)  # in the corridor
    assert trace.all("plan")[0]["tick"] == push["tick"]
    assert trace.one("resolved")["tick"] <= 12
    assert ("push", "cart") in findings(trace, told("push", 0, cart={"hold": 35}))


def test_a_robot_does_something_else_while_it_waits() -> None:
    away = WAITING.replace("[1, 1], heading", "[1, 9], heading").replace(
        "[[1, 1], [3, 3]]", "[[1, 13], [3, 13]]"
    )
    away = away.replace(
        "[[2, 12], [2, 1]]}}", "[[2, 12], [2, 1]]}, while_waiting: {visit: [[1, 1], [3, 1]]}}"
    )
    trace = completed(away)
    (push,) = trace.all("push")
    assert push["objectives"]["cart"] == {"visit": [16, 46]}
    opened = trace.one("resolved")["tick"]
    waiting = [g["region"] for g in trace.all("goal", robot="cart") if g["tick"] <= opened]
    assert waiting == [16, 46][: len(waiting)] != []
    assert ("push", "cart") in findings(trace, told("push", 0, cart={"visit": [17, 46]}))


CORRIDOR = """
name: the one who asks cannot be passed
map: {grid: ["##########", "#........#", "##########"]}
catalogue:
  robots:
    courier: {mobility: free, layer: ground, capabilities: [fetch]}
    cart: {mobility: free, layer: ground}
  obstacles:
    shutter: {needs: [{action: fetch, at: neighbours}]}
robots:
  c0: {model: courier, start: 17, objective: {cover: [13, {any: [11, 14]}]}}
  c1: {model: cart, start: 13, objective: {visit: [{any: [17, 11]}]}}
obstacles: [{type: shutter, region: 11}]
until: {rounds: 1}
"""


def test_a_request_that_no_joint_state_serves_is_set_aside() -> None:
    """Joint plans were made until the tick limit: the helper would have to pass the requester."""
    trace = completed(CORRIDOR)
    assert [line.get("aside") for line in trace.all("request")] == [None, True]
    assert trace.all("resolved") == []

    def passable(lines: list[dict[str, Any]]) -> None:
        """The two keep apart no longer, so that the helper could pass."""
        for robot in lines[0]["scenario"]["robots"].values():
            robot["conflicts"] = []

    assert ("proof", "c1") in findings(trace, passable)


def test_a_request_that_is_too_large_to_judge_is_noted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "trace.jsonl"
    path.write_text(play(CORRIDOR).text)
    assert check_trace(path).notes == ()
    monkeypatch.setattr(proofs, "MOST_SERVED", 5)
    found = check_trace(path)
    (note,) = found.notes
    assert found.ok
    assert (note.rule, note.robot) == ("proof", "c1")
    said = "whether shutter@11 can be resolved and the mission completed (more than 5 joint states)"
    assert note.explanation == f"not judged: {said}"
    printed = CliRunner().invoke(command, [str(path)])
    assert (printed.exit_code, str(note) in printed.output) == (0, True)
    bundle_of_trace(path, tmp_path / "bundle")
    evidence = Evidence(open_bundle(tmp_path / "bundle")[0])
    evidence.replay()
    claims = [claim["text"] for claim in evidence.claims if claim["kind"] == "unjudged"]
    assert claims == [f"Tick {note.tick}: Not judged: {said}."]
