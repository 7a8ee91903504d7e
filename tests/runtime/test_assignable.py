"""The second kind of coordination: goals assigned at runtime, without resynthesis."""

import pytest

from once import SCENARIOS
from runtime.played import completed, play
from runtime.test_case_studies import EVENTS


@pytest.mark.parametrize(
    ("number", "new_strategies"), [(1, []), (2, ["digit"]), (3, [])], ids=["door", "scout", "chain"]
)
def test_case_studies_need_new_strategies_only_for_new_walls(
    number: int, new_strategies: list[str]
) -> None:
    text = (SCENARIOS / f"case_study_{number}.yaml").read_text()
    usual = play(text)
    trace = completed(text.replace("until:", "coordination: assignable\nuntil:"))
    after_start = [s["robot"] for s in trace.all("synthesis") if s["tick"] > 0]
    assert after_start == new_strategies
    assert trace.order(*EVENTS) == usual.order(*EVENTS)
    for key in ("robot", "at", "proposed"):
        assert [v[key] for v in trace.all("violation")] == [v[key] for v in usual.all("violation")]


def test_requester_waits_and_helper_goes_while_signalled() -> None:
    text = (SCENARIOS / "case_study_1.yaml").read_text()
    trace = play(text.replace("until:", "coordination: assignable\nuntil:"))
    asked, done = trace.one("push")["tick"], trace.one("resolved")["tick"]
    assert {trace.position("quad", tick) for tick in range(asked, done + 1)} == {46}
    assert trace.position("digit", done) == 47


BESIDE = """\
name: {name}
map: {{grid: {grid}}}
catalogue:
  robots: {{bee: {{mobility: free, layer: air, capabilities: [push, clear]}}}}
  obstacles:
    gate: {{action: push, resolve_at: {at}}}
    order: {{action: clear, resolve_at: [16], blocks: []}}
robots: {{bee: {{model: bee, start: {start}, objective: {objective}}}}}
obstacles: [{{type: gate, region: {gate}}}]
{more}coordination: assignable
"""


@pytest.mark.parametrize(
    "text",
    [
        BESIDE.format(
            name="its own goal is met anywhere while it is sent, so it may go into the gate first",
            grid=["#######", "#.....#", "##.##.#", "#######"],
            **{"at": [19, 10], "start": 9, "objective": "{hold: 10}", "gate": 16, "more": ""},
        ),
        BESIDE.format(
            name="the path by the gate is as short as the one around it",
            grid=["#####", "#...#", "#...#", "#...#", "#####"],
            **{"at": [17], "start": 8, "objective": "{patrol: [8, 18]}", "gate": 12},
            more="orders: [{at: 3, type: order, region: 16}]\n",
        ),
    ],
    ids=["step", "path"],
)
def test_a_robot_is_led_past_an_obstacle_that_its_strategy_would_enter(text: str) -> None:
    trace = completed(text)
    assert len(trace.all("violation")) <= 2
