"""The checker judges the robots' execution separately from their plan: each planted error has its
rule."""

from collections.abc import Callable
from math import cos, sin
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from fleet.lab import HALL, Drive, driven
from safenav.motion.check.execution import trackings
from safenav.motion.check.verdict import check_motion
from safenav.motion.columns import columns_at
from safenav.motion.file import Flight, GoalLine, Measured, Measurement, Motion, Reset, Segment
from safenav.motion.waypoints import timed_waypoints
from safenav.trace.records import Act, ActionEnd, Arrive
from safenav.trace.vocabulary import MoveEnd

Change = Callable[[Measurement], Measurement | None]


@pytest.fixture(scope="module")
def drive() -> Drive:
    """Three robots that track references, and one that finds its own way to goals."""
    return driven(goals=("spot",))


def measured(motion: Motion, robot: str, change: Change) -> Motion:
    """The motion with other measurements of a robot; None drops one."""
    lines = [
        replace(line, rows=tuple(row for old in line.rows if (row := change(old)) is not None))
        if isinstance(line, Measured) and line.robot == robot
        else line
        for line in motion.lines
    ]
    kept = [line for line in lines if not isinstance(line, Measured) or line.rows]
    return replace(motion, lines=tuple(kept))


def rules(drive: Drive, motion: Motion) -> set[str]:
    return {finding.rule for finding in drive.judged(motion)}


def test_a_drive_is_accepted_and_its_errors_are_reported(drive: Drive) -> None:
    assert drive.judged() == []
    found = {one.robot: one for one in trackings(drive.motion, drive.trace)}
    assert found["spot"].driven == "goals" and found["spot"].off < 0.1
    for name in ("digit", "quad", "jackal"):
        assert found[name].driven == "setpoints" and 0 < found[name].off < 0.1
    kinds = {(type(line), getattr(line, "robot", "")) for line in drive.motion.lines}
    assert {(Segment, "digit"), (Flight, "quad"), (GoalLine, "spot"), (Measured, "spot")} <= kinds


def moved(**more: float) -> Change:
    return lambda row: replace(row, **{key: getattr(row, key) + by for key, by in more.items()})


def between(begin: float, end: float, change: Change) -> Change:
    return lambda row: change(row) if begin < row.t < end else row


ERRORS: dict[str, tuple[str, Change, set[str]]] = {
    "late by 0.8 s, of which a metre per second makes 0.5 m": ("quad", moved(t=0.8), {"tracking"}),
    "late by 20 ms": ("quad", moved(t=0.02), set()),
    "a corner cut": ("jackal", between(9.0, 9.2, moved(y=-1.0)), {"measured room", "tracking"}),
    "a fast clock": ("digit", lambda row: replace(row, stamp=row.stamp * 1.05), {"measured clock"}),
    "a slow clock": ("digit", lambda row: replace(row, stamp=row.stamp / 1.05), {"measured clock"}),
    "another clock": ("digit", moved(stamp=1e6), set()),
    "no measurement for 1.2 s": ("quad", between(1.0, 2.2, lambda _: None), {"measured rate"}),
    "no measurement at the end": ("spot", between(3.0, 1e9, lambda _: None), {"measured rate"}),
    "no measurement at all": ("digit", lambda _: None, {"measured rate"}),
}


@pytest.mark.parametrize("error", ERRORS)
def test_an_error_of_the_execution_is_found(drive: Drive, error: str) -> None:
    robot, change, wanted = ERRORS[error]
    found = drive.judged(measured(drive.motion, robot, change))
    rules = {finding.rule for finding in found}
    assert wanted <= rules and (wanted or not rules)
    assert {type(finding.t) for finding in found} <= {float}  # as JSON needs it


@pytest.mark.parametrize(
    ("many", "told", "wrong"),
    [
        (1, {"reason": "0.30 m off"}, False),
        (1, {"result": MoveEnd.FAILED}, False),
        (1, {}, True),
        (60, {"reason": "0.30 m off"}, True),
    ],
    ids=["another attempt", "failed", "untold", "late"],
)
def test_a_robot_held_when_it_lags_breaks_no_rule_if_the_trace_records_the_reason(
    drive: Drive, many: int, told: dict[str, Any], wrong: bool
) -> None:
    """A drive holds it at the first measurement beyond the tolerance, never much later."""
    at = _rows(drive.motion, "jackal")[100 : 100 + many]
    change = measured(
        drive.motion, "jackal", lambda row: replace(row, x=row.x + 0.3) if row in at else row
    )
    ends = [r for r in drive.trace.records if isinstance(r, Arrive) and r.robot == "jackal"]
    end = next(r for r in ends if (r.t or 0.0) >= at[0].t)
    records = [replace(r, **told) if r is end else r for r in drive.trace.records]
    trace = replace(drive.trace, records=tuple(records))
    held = Reset("jackal", at[0].t, at[0].x + 0.3, at[0].y, at[0].yaw, "0.30 m off")
    motion = replace(change, lines=(*change.lines, held))
    assert "tracking" in rules(drive, change)
    found = [one.found for one in check_motion(motion, trace) if one.rule == "tracking"]
    assert bool(found) is wrong
    assert bool(told) or found == ["held (0.30 m off), but the trace reports no failure then"]
    (tracked,) = [one for one in trackings(motion, drive.trace) if one.robot == "jackal"]
    assert tracked.held == 1 and "; held 1 time" in str(tracked)


@pytest.mark.parametrize("acts", [True, False])
def test_an_acting_robot_is_compared_with_no_plan(drive: Drive, acts: bool) -> None:
    """Also if it has failed, on what the team does not know."""
    at = _rows(drive.motion, "jackal")[100:140]
    moved = measured(
        drive.motion, "jackal", lambda row: replace(row, x=row.x + 0.3) if row in at else row
    )
    act = Act(0, 999, "jackal", ("jackal",), (), t=at[0].t)
    end = ActionEnd(0, 999, "jackal", {}, reason="door@12: failed", t=at[-1].t)
    trace = replace(drive.trace, records=(*drive.trace.records, *(act, end) * acts))
    found = {one.rule for one in check_motion(moved, trace)}
    assert ("tracking" in found) is not acts
    off = {one.robot: one.off for one in trackings(moved, trace)}
    assert (off["jackal"] < 0.1) is acts


def test_bodies_that_touch_are_found_although_their_plans_keep_apart(drive: Drive) -> None:
    spot = {round(row.t, 2): row for row in _rows(drive.motion, "spot")}

    def beside(row: Measurement) -> Measurement:
        other = spot.get(round(row.t, 2), row)
        return replace(row, x=other.x + 0.3, y=other.y)

    assert "measured distance" in rules(drive, measured(drive.motion, "jackal", beside))


def test_a_goal_that_is_missed_or_was_never_sent_is_found(drive: Drive) -> None:
    def goal(change: Callable[[GoalLine], GoalLine]) -> Motion:
        lines = [
            change(line) if isinstance(line, GoalLine) else line for line in drive.motion.lines
        ]
        return replace(drive.motion, lines=tuple(lines))

    assert "arrival" in rules(drive, goal(lambda line: replace(line, x=line.x + 0.5)))
    sent = [line for line in drive.motion.lines if not isinstance(line, GoalLine)]
    assert {"order", "arrival"} <= rules(drive, replace(drive.motion, lines=tuple(sent)))


def test_a_plan_that_continues_elsewhere_than_its_robot_is_found(drive: Drive) -> None:
    row = _rows(drive.motion, "jackal")[100]
    reset = Reset("jackal", row.t, row.x + 0.4, row.y, row.yaw, "told so")
    lines = replace(drive.motion, lines=(*drive.motion.lines, reset))
    found = drive.judged(lines)
    assert [finding.rule for finding in found] == ["tracking", "tracking"]
    said = " ".join(finding.found for finding in found)
    assert "its plan continues 0.400 m from where it was measured" in said
    assert "held (told so), but the trace reports no failure then" in said


def test_plan_and_execution_have_rules_of_their_own(drive: Drive) -> None:
    """A plan that jumps breaks a rule of plans, where the robot went on as it was."""
    flight = next(
        line
        for line in drive.motion.lines
        if isinstance(line, Flight) and line.robot == "quad" and line.origin != line.to
    )
    curve = flight.parts[0]
    moved = replace(flight, parts=(replace(curve, x=(curve.x[0] + 0.1, *curve.x[1:])),))
    lines = tuple(moved if line is flight else line for line in drive.motion.lines)
    assert rules(drive, replace(drive.motion, lines=lines)) == {"continuity"}


def test_a_run_may_end_before_a_step_that_its_trace_begins() -> None:
    """It is cut off by its time limit, at whatever moment of its steps that is."""
    for seconds in (1.0, 2.5, 4.0):
        cut = driven(HALL + f"limits: {{seconds: {seconds}}}\n", goals=("spot",))
        outcome = cut.trace.outcome
        assert outcome is not None and outcome.outcome == "time_limit"
        assert cut.judged() == []


def _rows(motion: Motion, robot: str) -> list[Measurement]:
    found = [line for line in motion.lines if isinstance(line, Measured) and line.robot == robot]
    return [row for line in found for row in line.rows]


def test_exports_and_requirements_use_measured_or_sent_values(drive: Drive) -> None:
    ways = {one.robot for one in timed_waypoints(drive.motion)}
    assert ways == set(drive.motion.header.robots)
    spot = [one for one in timed_waypoints(drive.motion) if one.robot == "spot"]
    x, y, yaw = drive.motion.header.origin
    goal = next(line for line in drive.motion.lines if isinstance(line, GoalLine))
    assert spot[0].x == pytest.approx(x + goal.x * cos(yaw) - goal.y * sin(yaw), abs=1e-5)
    assert spot[0].y == pytest.approx(y + goal.x * sin(yaw) + goal.y * cos(yaw), abs=1e-5)
    moved = measured(drive.motion, "quad", lambda row: replace(row, x=row.x + 0.4))
    times = np.arange(0.0, drive.motion.outcome.makespan, 0.1)
    for robot in drive.motion.header.robots:
        plain, shifted = (columns_at(one, robot, times, False) for one in (drive.motion, moved))
        off = 0.4 if robot == "quad" else 0.0
        assert np.allclose(shifted.place[0] - plain.place[0], off)
    planned = columns_at(moved, "quad", times, False, planned=True)
    assert np.abs(planned.place[0] - columns_at(moved, "quad", times, False).place[0]).min() > 0.3


def test_an_obstacle_that_no_robot_has_found_stops_none() -> None:
    """What a scenario lists need not stand in a drive's world."""
    listed = HALL + "obstacles: [{type: debris, region: [1, 4]}]\n"
    drive = driven(listed)
    assert drive.trace.outcome is not None and drive.trace.outcome.outcome == "completed"
    assert drive.judged() == []
