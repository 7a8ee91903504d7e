"""The times of motions, in lockstep and with a clock; their files, columns and waypoints."""

import json
import os
import random
from collections.abc import Callable
from itertools import pairwise
from math import cos, sin
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

from fleet.lab import driven
from motion.runs import SHIPPED, live_trace, motion, played, trace_bytes, trace_of
from once import beside
from safenav import InputError, Trace, UsageError, check_motion, motion_of
from safenav.motion import waypoints
from safenav.motion.check.examination import Finding
from safenav.motion.check.order import disorder
from safenav.motion.columns import columns_at, columns_of
from safenav.motion.file import Action, GoalLine, Measured, Moving, parsed, text_of
from safenav.motion.timing import dated, in_time, ordered, paces_of
from safenav.pace.robot import Pace
from safenav.trace import records
from safenav.trace.file import read_bytes
from safenav.trace.records import Service

SLOWED = int(os.environ.get("SAFENAV_MOTION_SLOWED", "10"))


def apart() -> Trace:
    """Two robots that must not be together in a zone."""
    return read_bytes(played(beside(__file__, "scenarios/apart.yaml")))


class Stroller(Pace):
    """Takes one to three seconds for a step, by chance, and sometimes one to halt."""

    chance: random.Random

    def step(self, now: float, origin: int, to: int, slower: float = 1.0) -> float:
        return super().step(now, origin, to, slower) - 1.0 + self.chance.uniform(1, 3)

    def _halting(self) -> float:
        return self.chance.choice([0.0, 1.0])


def disordered(trace: Trace, seed: int) -> list[Finding]:
    """What the checker finds in the order of a run by robots of any pace."""
    paces = {}
    for name in trace.robots:
        paces[name] = Stroller(trace.header.scenario.map.cols, 2.7, None)
        paces[name].chance = random.Random(f"{seed} {name}")
    serial = dated(trace, paces)
    moves = [r for r in trace.records if isinstance(r, records.Move) and r.to != r.from_]
    assert len([r for r in serial if isinstance(r, records.Arrive)]) == len(moves)
    return [*disorder(ordered(trace, serial), serial)]


@pytest.mark.parametrize("name", [*SHIPPED, "apart"])
def test_slow_robots_never_overlap_never_enter_a_door_early_and_all_end(name: str) -> None:
    """Nor are they together in a forbidden zone."""
    trace = apart() if name == "apart" else trace_of(name)
    for seed in range(SLOWED):
        assert disordered(trace, seed) == []


def test_a_robot_without_charge_stands_until_its_battery_is_replaced() -> None:
    lines = motion("battery_delivery").lines
    replaced = max(line.t1 for line in lines if isinstance(line, Action))
    moved = [m for m in lines if isinstance(m, Moving) and m.robot == "digit" and m.origin != m.to]
    flat = max(move.t1 for move in moved if move.t0 < replaced)
    assert flat < replaced <= min(move.t0 for move in moved if move.t0 >= flat)
    told = in_time(trace_of("battery_delivery"), motion("battery_delivery")).records
    served = [(record.active, record.t) for record in told if isinstance(record, Service)]
    assert served == [(False, pytest.approx(flat)), (True, pytest.approx(replaced))]
    trace, decisions = trace_of("battery_delivery"), records.Synthesis | records.Plan
    kept = tuple(record for record in trace.records if not isinstance(record, decisions))
    undecided = replace(trace, records=kept)  # a decision after it would hide that it waits
    assert check_motion(motion_of(undecided), undecided) == []


def test_times_that_ignore_conflicts_or_exclusions_are_refused() -> None:
    """As those of robots that heed less than the trace does."""
    for trace, rule in (
        (apart(), "never-together"),
        (trace_of("two_digits"), "overlap"),
    ):
        scenario = trace.header.scenario
        robots = tuple(replace(each, avoids=frozenset()) for each in scenario.robots)
        scenario = replace(scenario, robots=robots, never_together=())
        heedless = replace(trace, header=replace(trace.header, scenario=scenario))
        made = motion_of(heedless)
        serial = dated(heedless, paces_of(heedless, made.header))
        assert {found.rule for found in disorder(ordered(trace, serial), serial)} == {rule}
        assert "clock" in {found.rule for found in check_motion(made, trace)}
        assert check_motion(motion_of(trace), trace) == []


@pytest.mark.parametrize(
    ("name", "decision"), [("case_study_1", records.Synthesis), ("two_digits", records.Plan)]
)
def test_a_step_before_the_decision_that_it_follows_is_refused(name: str, decision: type) -> None:
    trace = trace_of(name)
    serial = [*dated(trace, paces_of(trace, motion(name).header))]
    timed = ordered(trace, serial)
    at = max(i for i, r in enumerate(serial) if isinstance(r, decision) and (r.t or 0.0) > 0)
    step = next(i for i, r in enumerate(serial) if i > at and isinstance(r, records.Depart))
    serial[step] = replace(serial[step], t=(serial[at].t or 0.0) - 0.1)
    (found,) = disorder(timed, serial)
    assert (found.rule, found.found[:14]) == ("order", "begins 0.100 s")


@pytest.mark.parametrize("clock", ["lockstep", "live"])
@pytest.mark.parametrize("kind", ["disc", "rover"])
def test_a_robot_acts_on_one_thing_after_the_other(kind: str, clock: str) -> None:
    """On two in front of the centre of its region, then from there on one beside it. With a clock
    it did all in front of it, and had no time for its next step: the run was refused."""
    text = beside(__file__, "scenarios/tidying.yaml").replace("speed:", f"motion: {kind}, speed:")
    trace = read_bytes(played(f"{text}clock: {clock}\n"))
    made = motion_of(trace)
    assert check_motion(made, trace) == []
    acts = made.of(Action)
    assert [act.obstacle for act in acts] == ["door@7", "parcel@7", "rubble@8"]
    x, _ = columns_at(made, "cart", np.array([(act.t0 + act.t1) / 2 for act in acts]), False).place
    assert x == pytest.approx([5.7, 5.7, 6.75])
    assert [act.t1 - act.t0 for act in acts] == pytest.approx([2.0] * 3)


def test_an_obstacle_appears_and_disappears_at_the_instants_of_its_ticks() -> None:
    """In 3D a door of tick 5 was there, and gone, from the beginning."""
    trace = read_bytes(played(beside(__file__, "scenarios/closing.yaml")))
    moved = motion_of(trace)
    steps = [line for line in moved.of(Moving) if line.origin != line.to]
    ends = {tick: max(line.t1 for line in steps if line.tick < tick) for tick in (5, 12)}
    told = {type(r): r.t for r in in_time(trace, moved).records}
    assert told[records.Appeared] == pytest.approx(ends[5])
    assert told[records.Gone] == pytest.approx(ends[12])


@pytest.mark.parametrize(
    ("name", "delayed"),
    [("beam", 0.4), ("case_study_2", 0.0), ("parked_robot", 0.4), ("case_study_1", 0.4)],
)
def test_motion_starts_at_departures_and_ends_at_arrivals(name: str, delayed: float) -> None:
    trace = read_bytes(live_trace(name, delayed))
    assert check_motion(motion_of(trace), trace) == []


def changed(change: Callable[[list[dict[str, Any]]], None]) -> Trace:
    """A live trace of case study 2 with other lines."""
    lines = [json.loads(line) for line in live_trace("case_study_2").splitlines()]
    change(lines)
    return read_bytes("".join(json.dumps(line) + "\n" for line in lines).encode())


def first(lines: list[dict[str, Any]], **wanted: object) -> dict[str, Any]:
    return next(line for line in lines if wanted.items() <= line.items())


def test_a_step_that_failed_stays_where_it_began() -> None:
    def fail(lines: list[dict[str, Any]]) -> None:
        """The first step of the quadcopter fails, and is tried again."""
        arrive = first(lines, type="arrive", robot="quad")
        for line in lines[1:]:
            if line["t"] >= arrive["t"] and line is not arrive:
                line["t"] += 20.0
        depart = first(lines, type="depart", robot="quad")
        again = {**arrive, "t": arrive["t"] + 10.0, "command": 901, "tick": depart["tick"]}
        lines[lines.index(arrive)] = {**arrive, "at": depart["from"], "result": "failed"}
        place = next(i for i, line in enumerate(lines) if i and line["t"] > again["t"])
        new = {**depart, "t": arrive["t"] + 1.0, "command": 901}
        lines[place:place] = [new, again]

    trace = changed(fail)
    made = motion_of(trace)
    assert check_motion(made, trace) == []
    steps = made.of(Moving, "quad")
    assert steps[0].origin == steps[0].to and steps[0].t1 > 5.0


@pytest.mark.parametrize(
    ("robot", "late", "at", "found"),
    [("digit", -2.0, None, "digit takes 3.54 s"), ("quad", 0.0, 54, "no motion shows how")],
)
def test_a_live_trace_that_no_motion_can_follow_is_refused(
    robot: str, late: float, at: int | None, found: str
) -> None:
    def change(lines: list[dict[str, Any]]) -> None:
        line = first(lines, type="arrive", robot=robot)
        line |= {"t": line["t"] + late, "at": at or line["at"]}

    with pytest.raises(InputError, match=found):
        motion_of(changed(change))


@pytest.mark.parametrize("name", ["case_study_1", "team_of_six"])
def test_file_is_read_as_it_was_written_without_further_lines_and_fields(name: str) -> None:
    text = text_of(motion(name))
    again = parsed(text.encode(), "again")
    assert again == motion(name) and text_of(again) == text
    first, second, *rest = text.splitlines()
    second = json.dumps({**json.loads(second), "colour": "red"})
    more = [first, second, '{"type": "weather", "rain": true}', *rest]
    assert parsed("\n".join(more).encode(), "more") == motion(name)


@pytest.mark.parametrize("to", [b"90", b"71"], ids=["a jump", "backwards"])
def test_no_motion_is_made_of_moves_that_no_robot_makes(to: bytes) -> None:
    """Such traces ended in KeyError, StopIteration or ZeroDivisionError."""
    content, old = trace_bytes("case_study_1"), b'"from":58,"to":57'
    assert old in content
    with pytest.raises(UsageError, match=r"moved\.jsonl breaks a rule"):
        motion_of(read_bytes(content.replace(old, old[:-2] + to, 1), "moved.jsonl"))


def test_columns_are_each_other_s_derivatives() -> None:
    for robot in ("digit", "quad"):
        columns = columns_of(motion("case_study_1"), robot, 1000.0).columns
        for axis in "xy":
            speed = np.gradient(columns[axis], 1e-3)
            assert np.abs(speed - columns[f"vel_{axis}"])[1:-1].max() < 0.01
        assert np.ptp(turns := np.unwrap(columns["yaw"])) > 1.0
        assert np.abs(np.diff(turns, 2)).max() < 1e-4  # it begins and ends its turns at rest


def test_columns_are_in_the_world_of_the_map_s_origin() -> None:
    header = replace(motion("case_study_1").header, origin=(10.0, 20.0, np.pi / 2))
    turned = columns_of(replace(motion("case_study_1"), header=header), "digit", 10.0).columns
    plain = columns_of(motion("case_study_1"), "digit", 10.0).columns
    np.testing.assert_allclose(turned["x"], 10 - plain["y"], atol=1e-9)
    np.testing.assert_allclose(turned["y"], 20 + plain["x"], atol=1e-9)
    np.testing.assert_allclose(turned["vel_x"], -plain["vel_y"], atol=1e-9)
    np.testing.assert_allclose(turned["yaw"], plain["yaw"] + np.pi / 2, atol=1e-9)


def test_timed_waypoints_are_the_ends_of_moves() -> None:
    found = waypoints.timed_waypoints(motion("case_study_1"))
    quad = [waypoint for waypoint in found if waypoint.robot == "quad"]
    assert quad[0].t == 0
    assert (quad[0].x, quad[0].y) == (4.05, 14.85)
    assert all(later.t >= earlier.t for earlier, later in pairwise(quad))
    assert quad[1].speed == pytest.approx(0.533, abs=1e-3)  # it flies through centres
    assert quad[-1].speed == 0
    walking = {round(w.speed, 3) for w in found if w.robot == "digit"}
    assert walking == {0.0, 0.45}
    assert waypoints.as_csv(found).splitlines()[0] == "robot,tick,t,x,y,z,yaw,speed,region"


def test_a_run_without_moves_still_has_all_poses() -> None:
    still = motion_of(read_bytes(played(beside(__file__, "scenarios/still.yaml"))))
    found = columns_of(still, "a", 10.0).columns
    assert set(found["x"]) == {1.5 * 2.7} and set(found["vel_x"]) == {0.0}


def test_columns_and_waypoints_of_a_drive_are_those_measured_or_sent() -> None:
    pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")
    drive = driven(goals=("spot",)).motion
    spot = [one for one in waypoints.timed_waypoints(drive) if one.robot == "spot"]
    x, y, yaw = drive.header.origin
    (goal,) = drive.of(GoalLine)
    assert spot[0].x == pytest.approx(x + goal.x * cos(yaw) - goal.y * sin(yaw), abs=1e-5)
    assert spot[0].y == pytest.approx(y + goal.x * sin(yaw) + goal.y * cos(yaw), abs=1e-5)
    east = [
        replace(line, rows=tuple(replace(row, x=row.x + 0.4) for row in line.rows))
        if isinstance(line, Measured) and line.robot == "quad"
        else line
        for line in drive.lines
    ]
    moved, times = replace(drive, lines=tuple(east)), np.arange(0.0, drive.outcome.makespan, 0.1)
    for robot in drive.header.robots:
        plain, shifted = (columns_at(one, robot, times, False) for one in (drive, moved))
        assert np.allclose(shifted.place[0] - plain.place[0], 0.4 * (robot == "quad"))
    planned = columns_at(moved, "quad", times, False, planned=True)
    assert np.abs(planned.place[0] - columns_at(moved, "quad", times, False).place[0]).min() > 0.3
