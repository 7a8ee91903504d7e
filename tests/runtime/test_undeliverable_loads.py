"""Robots that pass a load and have no path to where it is put down do not take it."""

import pytest

from certify.making import certified
from runtime.played import Run, completed
from safenav.scenario.settings import Clock

DOCK = """\
safenav: 1
map:
  grid: ["##########", "#........#", "#........#", "##########"]
  names: {shelf: [1, 6], dock: [1, 1], ramp: [1, 2]}
catalogue:
  robots:
    truck: {mobility: free, layer: ground, capabilities: [lift, drop]}
  obstacles:
    pallet:
      needs: [{action: lift, at: [shelf]}, {action: drop, at: [dock], same: true}]
      blocks: []
robots:
  a: {model: truck, start: [1, 7], objective: {visit: [[1, 5], [2, 8]], avoid: [dock, ramp]}}
  b: {model: truck, start: [2, 3], objective: {visit: [[2, 2], [2, 5]]}}
orders: [{at: 1, type: pallet, region: shelf}]
until: {rounds: 1}
"""
OTHER = "  b: {model: truck, start: [2, 3], objective: {visit: [[2, 2], [2, 5]]}}\n"
ALONE = DOCK.replace(OTHER, "")
CUT_OFF = "no path leads to where the load is put down"


def run_of(text: str, clock: Clock) -> Run:
    """A run that completes its mission, and whose trace the audit accepts."""
    return completed(text + f"clock: {clock.value}\n")


def who(run: Run) -> list[tuple[str, ...]]:
    """The robots that met each need."""
    return [tuple(line.get("robots") or [line["robot"]]) for line in run.all("met")]


def test_a_truck_leaves_a_load_to_one_that_may_enter_the_dock(clock: Clock) -> None:
    """It passes the shelf before the other arrives there."""
    run = run_of(DOCK, clock)
    assert who(run) == [("b",), ("b",)]
    assert run.one("request")["bids"]["a"] < run.one("request")["bids"]["b"]


def test_checkers_of_bundles_accept_it() -> None:
    certified(DOCK)
    certified(DOCK + "clock: live\n")


def test_no_robot_takes_a_load_that_none_can_put_down(clock: Clock) -> None:
    run = run_of(ALONE, clock)
    assert who(run) == [] and run.still_open == ["pallet@16"]
    assert CUT_OFF in run.one("blocked")["because"]


def test_a_wall_also_cuts_robots_off(clock: Clock) -> None:
    """A load can be taken on both sides of the wall, and put down on one."""
    text = ALONE.replace('"#........#"', '"#...#....#"').replace(", avoid: [dock, ramp]", "")
    assert who(run_of(text.replace("start: [1, 7]", "start: [1, 6]"), clock)) == []
    here = text.replace("lift, at: [shelf]", "lift, at: [shelf, ramp]")
    here = here.replace("start: [1, 7]", "start: [2, 1]").replace("[[1, 5], [2, 8]]", "[ramp]")
    assert who(run_of(here, clock)) == [("a",), ("a",)]


def test_a_group_takes_a_load_without_the_one_that_cannot_put_it_down(clock: Clock) -> None:
    """It stands at the shelf all the time."""
    text = DOCK.replace("at: [shelf]}", "at: [shelf, [2, 6]], robots: 2, together: true}")
    text = text.replace("at: [dock]", "at: [dock, ramp], together: true")
    text = text.replace("  obstacles:", DRONE + "  obstacles:").replace(
        "a: {model: truck", "a: {model: drone"
    )
    text = text.replace("start: [1, 7], objective: {visit: [[1, 5], [2, 8]]", AT_THE_SHELF)
    third = "  c: {model: truck, start: [2, 4], objective: {visit: [[2, 4], [2, 3]]}}\n"
    run = run_of(text.replace(OTHER, OTHER + third), clock)
    assert who(run) == [("b", "c"), ("b", "c")]


AT_THE_SHELF = "start: [1, 6], objective: {hold: shelf"
DRONE = "    drone: {mobility: free, layer: air, capabilities: [lift, drop]}\n"


def test_another_objective_opens_the_path(clock: Clock) -> None:
    change = "changes: [{at: 12, robot: a, objective: {visit: [[1, 5], [2, 8]]}}]\n"
    run = run_of(ALONE + change, clock)
    assert who(run) == [("a",), ("a",)]


def test_a_robot_ends_an_action_that_it_has_begun() -> None:
    """While it takes the load, it gets an objective that keeps it out of the dock."""
    change = "changes: [{at: 3, robot: a, objective: {visit: [[2, 8]], avoid: [dock]}}]\n"
    run = run_of(DOCK.replace(", avoid: [dock, ramp]", "") + change, Clock.LIVE)
    assert who(run) == [("a",)] and run.still_open == ["pallet@16"]


@pytest.mark.parametrize("need", [0, 1])
def test_the_audit_refuses_a_robot_that_takes_what_it_cannot_put_down(need: int) -> None:
    """The lines of one that may enter the dock, told of one that may not."""
    run = completed(ALONE.replace(", avoid: [dock, ramp]", ""))
    run.records[0]["scenario"]["robots"]["a"]["objective"]["avoid"] = [11, 12]
    found = [line for line in run.all("met") if line["need"] == need]
    assert found
    assert f"need {need + 1} of pallet@16 is not fulfilled in this turn" in run.findings
