"""Robots that wait for each other: each case ends well, and does not with resolution off."""

import re
import textwrap

import pytest

from once import SCENARIOS
from runtime.played import completed, play

ROVER = "catalogue: {robots: {rover: {mobility: free, layer: ground, capabilities: [push]}}}"

CASES = {
    "corridor swap": (SCENARIOS / "corridor_swap.yaml").read_text(),
    "parked in a doorway": f"""
        map: {{grid: ["#########", "#...#...#", "#.......#", "#...#...#", "#########"]}}
        {ROVER}
        robots:
          parked: {{model: rover, start: [2, 4], objective: {{hold: [2, 4]}}}}
          mover: {{model: rover, start: [2, 1], objective: {{visit: [[2, 7], [2, 1]]}}}}
        until: {{rounds: 1}}
        """,
    "three in a T junction": f"""
        map: {{grid: ["#########", "#.......#", "####.####", "####.####", "#########"]}}
        {ROVER}
        robots:
          west: {{model: rover, start: [1, 1], objective: {{visit: [[1, 7], [1, 1]]}}}}
          east: {{model: rover, start: [1, 7], objective: {{visit: [[3, 4], [1, 7]]}}}}
          south: {{model: rover, start: [3, 4], objective: {{visit: [[1, 1], [3, 4]]}}}}
        until: {{rounds: 1}}
        """,
    "a goal about a step": f"""
        map: {{grid: ["......"]}}
        {ROVER}
        robots:
          a: {{model: rover, start: 1, objective: {{ltl: {{liveness: [region = 3, region = 4]}}}}}}
          b:
            model: rover
            start: 5
            objective: {{ltl: {{liveness: [region = 2, "region = 1 & region' != 1"]}}}}
        until: {{rounds: 1}}
        """,
}


@pytest.mark.parametrize("name", CASES)
def test_a_robot_gives_way_without_a_synthesis(name: str) -> None:
    trace = completed(CASES[name])
    plans = trace.all("plan")
    assert plans
    assert [end["reason"] for end in trace.all("plan_end")] == ["reached"] * len(plans)
    assert any(len(places) > 1 for plan in plans for places in plan["robots"].values())
    assert {synthesis["reason"] for synthesis in trace.all("synthesis")} <= {"initial", "plan"}


@pytest.mark.parametrize("name", CASES)
def test_no_robot_does_with_resolution_off(name: str) -> None:
    text = re.sub("limits: .*\n", "", textwrap.dedent(CASES[name]))
    trace = play(f"{text}deadlock: off\nlimits: {{ticks: 100}}\n")
    assert trace.outcome["outcome"] == "tick_limit"
    assert trace.all("plan") == []


def test_corridor_is_used_in_one_direction_at_a_time() -> None:
    # Robots with heading mobility could not back out of it.
    trace = completed("""
        map:
          grid: |
            #############
            #...#####...#
            #...........#
            #...#####...#
            #############
        robots:
          a: {model: digit, start: [2, 1], heading: east, objective: {visit: [[1, 11], [1, 1]]}}
          b: {model: digit, start: [3, 11], heading: west, objective: {visit: [[3, 1], [3, 11]]}}
        """)
    corridor = set(range(2 * 13 + 4, 2 * 13 + 9))
    inside: dict[str, int] = {}
    for move in trace.all("move"):
        inside[move["robot"]] = move["to"]
        both = [region for region in inside.values() if region in corridor]
        if len(both) == 2:  # one behind the other, never head-on
            headings = {
                m["heading"] for m in trace.all("move", tick=move["tick"]) if m["to"] in corridor
            }
            assert len(headings) == 1


def test_formulas_that_remember_get_what_they_wait_for() -> None:
    """To be back at the west end after having been further east: places alone do not say whether
    that is met, so a plan takes the robot where its strategy is going."""
    trace = completed("""
        map: {grid: ["#########", "#.......#", "####.####", "#########"]}
        robots:
          a:
            model: quadcopter
            start: [1, 1]
            objective:
              ltl:
                memory: {seen: bool}
                init: "!seen"
                safety: ["seen' <-> (seen & region != 10) | region = 15"]
                liveness: ["seen & region = 10"]
          b:
            model: quadcopter
            start: [1, 7]
            objective: {ltl: {liveness: ["region = 11", "region = 16"]}}
        """)
    assert trace.all("plan")
    remembered, done = False, 0
    for region in trace.path("a"):
        remembered |= region == 15
        if region == 10 and remembered:
            remembered, done = False, done + 1
    assert done >= 2
