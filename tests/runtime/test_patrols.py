"""Patrols that may begin with either target."""

import re

import pytest

from runtime.played import completed, play
from safenav.errors import InputError

# A joint plan exists only if r0 begins its patrol with the target whose turn it is not.
ACROSS = """\
map: {grid: ["#####", "#...#", "#.#.#", "#...#", "#####"], resolution: 1}
catalogue:
  robots:
    m0: {mobility: heading, layer: ground, motion: disc, speed: 1}
    m1: {mobility: free, layer: ground, motion: disc, speed: 1}
robots:
  r0: {model: m0, start: 13, heading: east, objective: {patrol: [11, 18]}}
  r1: {model: m1, start: 7, objective: {visit: [13]}}
  r2: {model: m1, start: 6, objective: {once: [6], avoid: [8]}}
until: {rounds: 1}
"""
RESOLVED_BEFORE = """\
map: {grid: ["#####", "#...#", "#.#.#", "#####"], resolution: 1}
catalogue:
  robots:
    m0: {mobility: free, layer: ground, capabilities: [push], motion: disc, speed: 1}
    m1: {mobility: heading, layer: ground, motion: disc, speed: 1}
  obstacles: {t0: {action: push}}
robots:
  r0: {model: m0, start: 6, objective: {patrol: [6, 13]}}
  r1: {model: m1, start: 11, heading: east, objective: {hold: 7}}
never_together: [{robots: [r0, r1], in: [8, 11]}]
obstacles: [{type: t0, region: 7}]
until: {rounds: 1}
"""


@pytest.mark.parametrize("text", [ACROSS, RESOLVED_BEFORE], ids=["across", "resolved before"])
def test_a_patrol_begins_with_the_target_that_a_joint_plan_reaches(text: str) -> None:
    trace = completed(text)
    again = trace.one("synthesis", robot="r0", reason="plan")
    first = trace.all("goal", robot="r0")[-2]
    assert first["tick"] > again["tick"]
    literal = re.sub(r"(patrol: .*?\])", r"\1, form: literal", text)
    assert play(literal).outcome["outcome"] != "completed"


def test_a_patrol_with_equal_targets_suggests_hold() -> None:
    with pytest.raises(InputError, match="hold"):
        play("""
            map: {grid: "####\\n#..#\\n####\\n"}
            robots: {a: {model: quadcopter, start: 5, objective: {patrol: [6, 6]}}}
            """)


@pytest.mark.parametrize(("start", "first"), [(8, 0), (11, 1)], ids=["first", "second"])
def test_patrol_may_start_on_either_target(start: int, first: int) -> None:
    trace = completed(f"""
        map: {{grid: ["######", "#....#", "######"]}}
        robots: {{a: {{model: quadcopter, start: {start - 1}, objective: {{patrol: [7, 10]}}}}}}
        """)
    goals = trace.all("goal")
    assert goals[0]["goal"] == first
    assert [g["goal"] for g in goals] == [(first + i) % 2 for i in range(len(goals))]
