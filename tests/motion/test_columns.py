"""Sampled columns and timed waypoints: the same motion, as tables."""

import io
from itertools import pairwise

import numpy as np
import pytest
from msgspec.structs import replace

from motion.runs import motion, played, trace_of
from safenav.motion import waypoints
from safenav.motion.check.verdict import check_motion
from safenav.motion.columns import columns_of, npz_bytes
from safenav.motion.making import Disturbances, motion_of
from safenav.trace.reading import read_bytes

NAME = "case_study_1"


def test_columns_are_each_other_s_derivatives() -> None:
    for robot, place in (("digit", "com_"), ("quad", "")):
        columns = columns_of(motion(NAME), robot, 1000.0).columns
        for axis in "xy":
            speed = np.gradient(columns[f"{place}{axis}"], 1e-3)
            assert np.abs(speed - columns[f"vel_{axis}"])[1:-1].max() < 0.01


def test_columns_are_in_the_world_of_the_map_s_origin() -> None:
    header = replace(motion(NAME).header, origin=(10.0, 20.0, np.pi / 2))
    turned = columns_of(replace(motion(NAME), header=header), "digit", 10.0).columns
    plain = columns_of(motion(NAME), "digit", 10.0).columns
    np.testing.assert_allclose(turned["com_x"], 10 - plain["com_y"], atol=1e-9)
    np.testing.assert_allclose(turned["com_y"], 20 + plain["com_x"], atol=1e-9)
    np.testing.assert_allclose(turned["vel_x"], -plain["vel_y"], atol=1e-9)
    np.testing.assert_allclose(turned["yaw"], plain["yaw"] + np.pi / 2, atol=1e-9)


def test_tables_hold_all_columns() -> None:
    found = columns_of(motion(NAME), "quad", 10.0)
    with np.load(io.BytesIO(npz_bytes(motion(NAME), 10.0))) as archive:
        np.testing.assert_allclose(archive["quad.x"], found.columns["x"])
        assert {"t", "quad.x", "digit.com_x", "digit.left_yaw"} <= set(archive.files)


def test_flight_in_wind_has_its_attitude_and_its_reference() -> None:
    made = motion_of(trace_of(NAME), None, Disturbances(gust=2.0))
    found = columns_of(made, "quad", 20.0).columns
    off = np.hypot(found["x"] - found["ref_x"], found["y"] - found["ref_y"])
    assert 0 < off.max() < 0.15
    length = sum(found[f"q_{axis}"] ** 2 for axis in "wxyz")
    assert np.abs(length - 1).max() < 0.01


def test_timed_waypoints_are_where_and_when_moves_end() -> None:
    found = waypoints.timed_waypoints(motion(NAME))
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
