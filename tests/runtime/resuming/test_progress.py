"""Progress of objectives counts in the rest of a run, and deadlines stay due."""

import json

import pytest
from msgspec.structs import replace
from safenav.runtime.analysis.resuming import resumed

from runtime.facts import case
from runtime.played import completed, loaded, play
from runtime.resuming.cuts import DUE, KINDS, ONE, TIGHT, begun, continued, goals
from safenav.begun import Begun, Done
from safenav.trace.reading import read_lines


def test_a_literal_objective_stays_literal_in_the_rest() -> None:
    original = loaded("""
        map: {grid: [".....", "....."]}
        robots:
          r: {model: husky, start: 5, objective: {patrol: [4, 0, 9], form: literal, avoid: 2}}
        """)
    rest = resumed(read_lines(play(original).upto("goal")))
    assert rest.robots[0].objective == original.robots[0].objective
    assert begun(rest).robots["r"].turn == 1


@pytest.mark.parametrize("kind", KINDS)
def test_the_rest_meets_only_the_goals_that_the_round_still_lacks(kind: str) -> None:
    """Wherever the run is cut off, its rest meets the goals that are left, and completes it."""
    scenario = loaded(ONE % KINDS[kind])
    whole = play(scenario)
    met = goals(whole.records)
    for end in range(2, len(whole.records) - 1, 2):
        rest = continued(whole, end, scenario)
        assert rest.outcome["outcome"] == "completed", end
        assert rest.outcome["rounds"] == whole.outcome["rounds"], end
        before, after = goals(whole.records[:end]), goals(rest.records)
        if kind in ("once", "hold", "shared once") and before[-1:] == met[-1:]:
            assert {goal for _, goal, _ in after} == {before[-1][1]}  # it stays there
        else:
            assert before + after == met, end


CROSSES = """
map: {grid: ["......"]}
robots:
  a: {model: husky, start: 3, objective: {patrol: [{any: [1, 2]}, 0]}}
  b: {model: husky, start: 5, objective: {hold: 5}}
"""


def test_a_target_that_a_robot_crosses_does_not_count_again() -> None:
    """Nor where it has had its turn, and the other robot has not."""
    scenario = loaded(CROSSES)
    whole = play(scenario)
    met = [one for one in goals(whole.records) if one[0] == "a"]
    for end in range(2, len(whole.records) - 1):
        rest = goals(whole.records[:end]) + goals(continued(whole, end, scenario).records)
        assert [one for one in rest if one[0] == "a"] == met, end


def test_deadlines_of_the_rest_are_due_at_the_ticks_of_the_run() -> None:
    """At the end of a tick, the rest is due with the run, and completed no later."""
    scenario = loaded(case("resumed/door_with_deadlines"))
    whole = play(scenario)
    ticks = [line.get("tick", 0) for line in whole.records]
    due = {(line["of"], line["due"]) for line in whole.all("deadline")}
    for tick in range(3, 29, 5):
        rest = continued(whole, ticks.index(tick + 1), scenario)
        judged = {(one["of"], tick + one["due"]) for one in rest.all("deadline")}
        assert judged, tick
        assert judged <= due, tick
        assert tick + rest.outcome["ticks"] <= whole.outcome["ticks"]


LEAVE_TOGETHER = """
map: {grid: [".....", "####.", "....."]}
catalogue: {robots: {slow: {mobility: free, layer: ground, capabilities: [push], timing: 7}}}
robots:
  p: {model: quadcopter, start: 0, objective: {visit: [2, 0]}}
  q: {model: quadcopter, start: 10, objective: {visit: [12, 10]}}
  d: {model: slow, start: 4, objective: {hold: 4}}
obstacles:
  - {type: door, region: 1, until: 5, resolve_within: 90}
  - {type: door, region: 11, until: 5, resolve_within: 90}
until: {rounds: 1}
"""


def test_an_obstacle_that_disappears_in_the_last_tick_is_not_due_in_the_rest() -> None:
    """The trace ends between the lines of two doors that disappear in the same tick."""
    scenario = loaded(LEAVE_TOGETHER)
    run = play(scenario)
    before = resumed(read_lines(run.upto("gone")[:-1]), scenario)
    assert {*begun(before).due} == {"door@1", "door@11"}
    rest = continued(run, len(run.upto("gone")), scenario)
    assert rest.records[0]["scenario"]["begun"].get("due", {}) == {}
    assert not rest.findings


@pytest.mark.parametrize(
    ("by", "late", "tick", "due", "outcome", "broken"),
    [
        (30, "stop", 4, 26, "completed", []),  # in time
        (18, "stop", 4, 14, "completed", []),
        (10, "stop", 4, 6, "late", ["mission"]),  # was possible once, is not refused
        (10, "go_on", 4, 6, "completed", ["mission"]),
        (10, "stop", 10, 0, "late", ["mission"]),  # its tick was over
        (10, "go_on", 14, 0, "completed", ["mission"]),  # it is late already, and still is
    ],
)
def test_the_mission_deadline_stays_due_at_its_tick(
    by: int, late: str, tick: int, due: int, outcome: str, broken: list[str]
) -> None:
    """Of a run that was cut off in that tick; also if the rest cannot keep it."""
    scenario = loaded(DUE % (by, late))
    whole = play(replace(scenario, until=replace(scenario.until, by=99)))
    first = [line for line in whole.lines if json.loads(line).get("tick", 0) <= tick]
    rest = resumed(read_lines(first), scenario)
    assert rest.until.by == due
    run = play(rest)
    assert (run.outcome["outcome"], run.outcome["late"]) == (outcome, broken)


def test_the_rest_of_a_run_that_was_late_has_no_mission_deadline() -> None:
    scenario = loaded(DUE % (18, "stop"))
    until = replace(scenario.until, by=12)
    late = play(replace(scenario, until=until, begun=Begun(robots={"r": Done()}, ran=True)))
    assert late.outcome["outcome"] == "late"
    rest = resumed(read_lines(late.lines), scenario)
    assert rest.until.by is None
    completed(rest)


@pytest.mark.parametrize("by", [20, 19], ids=["in time", "late"])
def test_the_rest_is_late_exactly_if_the_run_is(by: int) -> None:
    """Though the tick in which the trace ends may not be over."""
    scenario, before = loaded(TIGHT % 20), Begun(robots={"a": Done()}, ran=True)
    scenario = replace(scenario, until=replace(scenario.until, by=by), begun=before)
    whole = play(scenario)
    assert whole.outcome["outcome"] == ("completed" if by == 20 else "late")
    for end in range(2, len(whole.records) - 1, 3):
        if whole.records[end]["type"] != "deadline":
            rest = continued(whole, end, scenario)
            assert rest.outcome["outcome"] == whole.outcome["outcome"], end
