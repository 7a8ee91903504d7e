"""Motion files, and the columns and waypoints of a motion."""

import json
from itertools import pairwise
from math import cos, sin

import numpy as np
import pytest
from msgspec.structs import replace

from fleet.lab import driven
from motion.runs import motion, played, trace_bytes
from safenav.errors import InputError, UsageError
from safenav.motion import waypoints
from safenav.motion.check.verdict import check_motion
from safenav.motion.columns import columns_at, columns_of
from safenav.motion.file import GoalLine, Measured, parsed, text_of
from safenav.motion.making import motion_of
from safenav.trace.file import read_bytes


@pytest.mark.parametrize("name", ["case_study_1", "team_of_six"])
def test_file_is_read_as_it_was_written(name: str) -> None:
    text = text_of(motion(name))
    again = parsed(text.encode(), "again")
    assert again == motion(name)
    assert text_of(again) == text


def test_further_lines_and_fields_are_skipped() -> None:
    lines = text_of(motion("case_study_1")).splitlines()
    lines.insert(3, '{"type": "weather", "rain": true}')
    first = json.loads(lines[1])
    lines[1] = json.dumps({**first, "colour": "red"})
    assert parsed("\n".join(lines).encode(), "more") == motion("case_study_1")


BROKEN = {
    "empty": ("", "empty"),
    "no header": ("{}", "first line must be the header"),
    "another version": ('{"type": "header", "motion": 9}', "this safenav reads 1"),
    "a header without a trace": ('{"type": "header", "motion": 1}', "`trace` is missing"),
    "no JSON": ("nonsense", "not JSON: Expecting value at column 1"),
    "missing": ({"phases": None}, "`phases` must be a list"),
    "text": ({"t0": "soon"}, "`t0` must be a number, not a string"),
    "a short row": ({"phases": [[1]]}, r"`phases\[0\]` must be a list of at least length 5"),
    "a short foot": ({"swings": [[1, 0, 1, 0, 1, [0], [0]]]}, "must be a list of length 9"),
    "cut off": ({"type": "unknown"}, "without its 'outcome' line: it was cut off"),
}


@pytest.mark.parametrize("what", BROKEN)
def test_a_broken_file_is_reported_with_its_line_and_field(what: str) -> None:
    change, words = BROKEN[what]
    lines = text_of(motion("case_study_1")).splitlines()
    wanted = '"outcome"' if what == "cut off" else '"segment"'
    index = next(i for i, line in enumerate(lines) if wanted in line)
    if isinstance(change, dict):
        lines[index] = json.dumps({**json.loads(lines[index]), **change})
    else:
        index, lines = 0, [change]
    with pytest.raises(InputError, match=words) as refused:
        parsed("\n".join(lines).encode(), "file")
    assert refused.value.diagnostics[0].line == index + 1


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
    content = played(
        "safenav: 1\nmap: {grid: ['#####', '#...#', '#####']}\n"
        "robots: {a: {model: quadcopter, start: [1, 1], objective: {hold: [1, 1]}}}\n"
        "until: {rounds: 1}\n"
    )
    trace = read_bytes(content, "made")
    still = motion_of(trace)
    found = columns_of(still, "a", 10.0).columns
    assert set(found["x"]) == {1.5 * 2.7} and set(found["vel_x"]) == {0.0}
    assert check_motion(still, trace) == []


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
