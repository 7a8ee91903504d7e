"""Orders, inputs and services of small teams. An exhaustive search over joint states, which shares
no code with safenav, has decided what each team can do; the audit judges each trace."""

import re

import pytest

from runtime.played import completed, play
from safenav.scenario.settings import Clock

TRAP = """\
# b has been at 17 and is to visit 7 before a, which never leaves it again.
map: {grid: ["#####", "##.##", "#...#", "##..#", "#####"]}
catalogue:
  robots:
    m0: {mobility: free, layer: ground, capabilities: []}
    m1: {mobility: free, layer: ground, capabilities: [look]}
  obstacles: {p0: {action: look, resolve_at: [18], blocks: []}}
robots:
  a: {model: m0, start: 12, objective: {visit: [7], always: "region = 7 -> region' != 12"}}
  b: {model: m1, start: 13, objective: {once: [17, 7], avoid: [11]}}
orders: [{at: 8, type: p0, region: 18}]
"""

ONE_WAY = """\
# The regions are in a line: r1 cannot pass r0 to 11, and has a rule that makes moves irreversible.
map: {grid: ["#####", "#...#", "#.#.#", "#####"]}
catalogue:
  robots:
    m0: {mobility: free, layer: ground, capabilities: [look]}
    m1: {mobility: free, layer: ground, capabilities: [lift, look]}
  obstacles:
    p0: {action: look, resolve_at: [8], blocks: []}
    p1: {action: lift, resolve_at: [11], blocks: []}
robots:
  r0: {model: m0, start: 6, objective: {cover: [6, 11]}, while_waiting: {visit: [6, 13, 8]}}
  r1: {model: m1, start: 7, objective: {visit: [8, 6], always: "region = 8 -> region' != 13"}}
orders: [{at: 5, type: p0, region: 8}, {at: 7, type: p1, region: 11}]
until: {rounds: 1}
"""

WALLED = """\
# r1 cannot turn in the corridor: one of the two cannot deliver past it and come back.
map: {grid: ["#######", "#.....#", "#######"]}
catalogue:
  robots:
    m0: {mobility: free, layer: ground, capabilities: [lift]}
    m1: {mobility: heading, layer: ground, capabilities: []}
  obstacles:
    p0: {needs: [{action: lift, at: [10]}, {action: lift, at: [9], same: true}], blocks: []}
robots:
  r0: {model: m0, start: 12, objective: {visit: [11]}, avoids: []}
  r1: {model: m1, start: 9, heading: west, objective: {hold: 9}}
orders: [{at: 4, type: p0, region: 10}]
"""

KEEPS_ROOM = """\
# The robot that is sent for one load keeps room for it: it does not take what it passes.
map: {grid: ["#######", "#.....#", "#######"]}
catalogue:
  robots:
    m0: {mobility: free, layer: air, capabilities: [lift, look]}
    m1: {mobility: free, layer: air, capabilities: []}
    m2: {mobility: free, layer: air, capabilities: [lift]}
  obstacles:
    t0: {action: look, resolve_at: self, blocks: [ground]}
    p0: {needs: [{action: lift, at: [8]}, {action: lift, at: [12], same: true}], blocks: []}
    p1: {needs: [{action: lift, at: [8]}, {action: lift, at: [12], same: true}], blocks: []}
    p2: {needs: [{action: lift, at: [11]}, {action: lift, at: [9], same: true}], blocks: []}
robots:
  r0: {model: m0, start: 10, objective: {cover: [12, 8]}}
  r1: {model: m1, start: 11, objective: {visit: [12, 9]}}
  r2: {model: m2, start: 8, objective: {patrol: [11, 12]}, avoids: [r0]}
obstacles: [{type: t0, region: 9}]
orders:
  - {at: 2, type: p0, region: 8}
  - {at: 6, type: p1, region: 8}
  - {at: 8, type: p2, region: 11}
until: {rounds: 1}
order: oldest
"""

TWO_LOADS = """\
# The proof is about what the robots carry, not about what they could take where they stand.
map: {grid: ["######", "#....#", "######"]}
catalogue:
  robots:
    m0: {mobility: free, layer: ground, capabilities: []}
    m1: {mobility: free, layer: ground, capabilities: [lift]}
  obstacles:
    p0: {needs: [{action: lift, at: [7]}, {action: lift, at: [7], same: true}], blocks: []}
    p1: {needs: [{action: lift, at: [8]}, {action: lift, at: [7], same: true}], blocks: []}
robots:
  r0: {model: m0, start: 8, objective: {once: [8, 9]}}
  r1: {model: m1, start: 10, objective: {once: [10, 7]}}
orders: [{at: 2, type: p1, region: 8}, {at: 8, type: p0, region: 7}]
until: {rounds: 1}
"""

EXCLUSION = """\
# Only one of them may be in 6, 12 and 13, so r1 never gets past r0 to where it would deliver.
map: {grid: ["#####", "#.#.#", "#...#", "#####"]}
catalogue:
  robots:
    m0: {mobility: free, layer: ground, capabilities: []}
    m1: {mobility: free, layer: ground, capabilities: [lift], carries: 2}
  obstacles:
    p0: {needs: [{action: lift, at: [6]}, {action: lift, at: [12], same: true}], blocks: []}
    p1: {needs: [{action: lift, at: [11]}, {action: lift, at: [6], same: true}], blocks: []}
robots:
  r0: {model: m0, start: 12, objective: {once: [6, 12]}}
  r1: {model: m1, start: 8, objective: {visit: [12, 13]}}
never_together: [{robots: [r0, r1], in: [6, 12, 13]}]
orders: [{at: 3, type: p0, region: 6}, {at: 4, type: p1, region: 11}]
until: {rounds: 1}
"""


ONE_OF_TWO = """\
# r1 cannot pass r0 to 11, for which it is sent and keeps room; then it takes the load at 12.
map: {grid: ["#####", "###.#", "#...#", "#####"]}
catalogue:
  robots:
    m0: {mobility: free, layer: ground, capabilities: []}
    m1: {mobility: free, layer: ground, capabilities: [lift]}
  obstacles:
    p0: {needs: [{action: lift, at: [11]}, {action: lift, at: [13], same: true}], blocks: []}
    p1: {needs: [{action: lift, at: [12]}, {action: lift, at: [13], same: true}], blocks: []}
robots:
  r0: {model: m0, start: 13, objective: {patrol: [13, 12]}}
  r1: {model: m1, start: 8, objective: {hold: 8}}
orders: [{at: 1, type: p0, region: 11}, {at: 6, type: p1, region: 12}]
until: {rounds: 1}
order: oldest
"""


OTHER_RULES = """\
# r0 must not go to 12 for its load before it gets an objective without that rule.
map: {grid: ["#####", "#..##", "#...#", "#.#.#", "#####"]}
catalogue:
  robots: {m0: {mobility: free, layer: ground, capabilities: [lift]}}
  obstacles:
    p0: {needs: [{action: lift, at: [16]}, {action: lift, at: [13], same: true}], blocks: []}
    p1: {needs: [{action: lift, at: [12]}, {action: lift, at: [6], same: true}], blocks: []}
robots:
  r0: {model: m0, start: 11, objective: {visit: [16, 6], avoid: [12]}}
orders: [{at: 2, type: p0, region: 16}, {at: 4, type: p1, region: 12}]
changes: [{at: 8, robot: r0, objective: {hold: 18}}]
"""


@pytest.mark.parametrize(
    ("text", "outcome", "done"),
    [
        pytest.param(OTHER_RULES, "completed", ["p0@16", "p1@12"], id="another objective"),
        pytest.param(TRAP, "completed", ["p0@18"], id="an order ends a plan that changes duties"),
        pytest.param(ONE_WAY, "completed", ["p0@8"], id="a rule makes moves irreversible"),
        pytest.param(WALLED, "completed", [], id="an order that no joint state serves"),
        pytest.param(KEEPS_ROOM, "operator_needed", [], id="joint plans keep room for a load"),
        pytest.param(ONE_OF_TWO, "completed", ["p1@12"], id="only what no joint state serves"),
        pytest.param(TWO_LOADS, "operator_needed", [], id="a proof with two loads"),
        pytest.param(EXCLUSION, "completed", [], id="never together where a load is taken"),
    ],
)
def test_what_can_be_done_is_done(text: str, outcome: str, done: list[str]) -> None:
    trace = play(text)
    assert trace.outcome["outcome"] == outcome
    orders = {line["obstacle"] for line in trace.all("order")}
    resolved = {line["obstacle"] for line in trace.all("resolved")} & orders
    assert sorted(resolved) == done
    if outcome == "completed":
        assert sorted(trace.still_open) == sorted(orders - resolved)


def test_a_trap_is_explained_by_what_would_be_lost() -> None:
    """The robot could still meet its objective from where it is: nothing else conflicts."""
    ended = play("""
        map: {grid: [".......", "###.###", "......."]}
        catalogue: {robots: {cart: {mobility: free, layer: ground}}}
        robots:
          c: {model: cart, start: 0, objective: {visit: [14, 0]}}
          d: {model: digit, start: 20, heading: west, objective: {hold: 20}}
        obstacles: [{type: door, region: 10}]
        """).outcome
    assert ended["explanation"] == (
        "every remaining option traps a robot needed elsewhere; "
        "d could no longer hold 20 after that"
    )


def test_a_lack_of_room_that_shows_after_an_action_is_no_trap() -> None:
    """Two must clear it together, from the one region beside it that they reach."""
    ended = play("""
        map: {grid: ["...#...", "......."]}
        catalogue:
          obstacles:
            rubble:
              needs:
                - {action: sense, at: neighbours}
                - {action: clear, robots: 2, at: neighbours, together: true}
              blocks: [ground]
        robots:
          eye: {model: quadcopter, start: 0, objective: {hold: 0}}
          a: {model: husky, start: 7, objective: {visit: [13, 7]}}
          b: {model: husky, start: 1, objective: {hold: 1}}
        obstacles: [{type: rubble, region: 10}]
        """).outcome
    assert ended["outcome"] == "operator_needed"
    assert ended["explanation"] == (
        "rubble@10 needs two robots with 'clear' at the same time; a and b reach only 9 for it, "
        "where there is no room for all of them"
    )


RULES = """\
# While the alarm is on r0 has no rules; the duty that it has then is under its rules afterwards.
map: {grid: ["######", "#....#", "#...##", "#....#", "######"]}
catalogue:
  robots:
    m0: {mobility: free, layer: ground, capabilities: [clear, push]}
    m1: {mobility: free, layer: ground, capabilities: [lift]}
  obstacles:
    t0: {action: lift, resolve_at: neighbours}
    p0: {action: clear, resolve_at: [21], blocks: []}
    p1: {action: clear, resolve_at: [14], blocks: []}
inputs: {alarm: {at: [2-4]}}
robots:
  r0:
    model: m0
    start: 10
    objective: {patrol: [14, 9], avoid: [8], always: "region = 14 -> region' != 15"}
    when: {alarm: {visit: [10, 15, 22]}}
  r1: {model: m1, start: 19, objective: {hold: 13}}
obstacles: [{type: t0, region: 9}]
orders: [{at: 3, type: p0, region: 21}, {at: 6, type: p1, region: 14}]
"""

ALARM_WITHOUT_WAY = """\
# During the alarm r0 has no way to 13, so the team waits; the input is told once. Meanwhile r1 does
# an order at its target, which counts.
map: {grid: ["#####", "#...#", "#...#", "#####"]}
catalogue:
  robots:
    m0: {mobility: free, layer: air, capabilities: []}
    m1: {mobility: free, layer: ground, capabilities: [lift, look]}
  obstacles:
    t0: {action: look, resolve_at: neighbours, has_truth: true}
    p0: {needs: [{action: lift, at: [7]}, {action: lift, at: [7], same: true}], blocks: []}
inputs: {alarm: {at: [3-9]}}
robots:
  r0: {model: m0, start: 6, objective: {patrol: [8, 7]}, when: {alarm: {visit: [13, 11]}}}
  r1: {model: m1, start: 12, objective: {patrol: [6, 7]}}
obstacles: [{type: t0, region: 13, traversable: false}]
orders: [{at: 4, type: p0, region: 7}]
until: {rounds: 1}
"""

EQUAL = """\
# The objective during an alarm is that without one: the run is not completed while it is on.
map: {grid: ["######", "#....#", "######"]}
inputs: {alarm: {at: [2-9]}}
robots:
  r0: {model: quadcopter, start: 7, objective: {hold: 9}, when: {alarm: {hold: 9}}}
until: {rounds: 1}
"""

OWN_CHANGED = """\
# An alarm changes what r0 does beside its duty, while the entry of an order is on the stack.
map: {grid: ["#####", "#...#", "#...#", "#####"]}
catalogue:
  robots: {m0: {mobility: free, layer: air, capabilities: [lift]}}
  obstacles:
    p0: {needs: [{action: lift, at: [12]}, {action: lift, at: [13], same: true}], blocks: []}
    p1: {needs: [{action: lift, at: [7]}, {action: lift, at: [11], same: true}], blocks: []}
inputs: {alarm: {at: [5]}}
robots:
  r0:
    model: m0
    start: 13
    objective: {visit: [7, 12]}
    when: {alarm: {patrol: [11, 13]}}
orders: [{at: 4, type: p0, region: 12}, {at: 5, type: p1, region: 7}]
until: {rounds: 1}
"""

OUT = """\
# r1 is out of service where the order is done: it does it in its next turn, and no robot helps.
map: {grid: ["######", "#....#", "######"]}
catalogue:
  robots:
    m0: {mobility: free, layer: ground, capabilities: [lift]}
    m1: {mobility: free, layer: ground, capabilities: [clear]}
  obstacles: {p0: {action: clear, resolve_at: [9], blocks: []}}
robots:
  r0: {model: m0, start: 7, objective: {visit: [7, 8]}}
  r1: {model: m1, start: 9, objective: {hold: 9}}
orders: [{at: 8, type: p0, region: 9}]
changes: [{at: 5, robot: r1, service: out}, {at: 14, robot: r1, service: back}]
until: {rounds: 1}
"""


@pytest.mark.parametrize(
    "text",
    [RULES, EQUAL, OWN_CHANGED, ALARM_WITHOUT_WAY],
    ids=["rules", "equal", "own changed", "a wait"],
)
def test_inputs_change_objectives_beside_duties(text: str) -> None:
    trace = completed(text)
    assert trace.one("inputs", values={"alarm": True})
    assert trace.one("inputs", values={"alarm": False})


def test_one_out_of_service_acts_where_it_stands() -> None:
    trace = play(OUT)
    request = trace.one("request")
    assert (request["helper"], request["because"]) == (None, "r1 is out of service")
    assert trace.one("resolved")["robot"] == "r1"


OWN_AS_DUTY = """\
# r0 gets an objective of its own that reads as its duty.
map: {grid: ["#####", "##.##", "#...#", "#####"], resolution: 1}
catalogue:
  robots:
    m0: {mobility: free, layer: ground, capabilities: [clear, look, push], motion: disc, speed: 1}
    m1: {mobility: free, layer: ground, capabilities: [lift, look, push], motion: disc, speed: 1}
  obstacles:
    t0: {action: look, resolve_at: self, blocks: [ground]}
    p0: {action: push, resolve_at: [13], blocks: []}
    p1: {action: clear, resolve_at: [11], blocks: []}
    p2: {action: look, resolve_at: [13], blocks: []}
robots:
  r0: {model: m0, start: 13, objective: {cover: [12], avoid: [7]}}
  r1: {model: m1, start: 11, objective: {visit: [13, 7]}}
obstacles: [{type: t0, region: 12}]
orders:
  - {at: 4, type: p0, region: 13}
  - {at: 1, type: p1, region: 11}
  - {at: 6, type: p2, region: 13}
changes:
  - {at: 3, robot: r0, objective: {visit: [11, 12]}}
  - {at: 5, robot: r1, service: out}
  - {at: 14, robot: r1, service: back}
"""


def test_an_own_objective_may_read_as_a_duty(clock: Clock) -> None:
    trace = completed(f"{OWN_AS_DUTY}clock: {clock.value}\n")
    assert "still open" not in trace.outcome["explanation"]


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
