"""The 3D page of a drive: a body where a robot was measured, a ghost where the plan had it."""

import json
import zlib
from base64 import b64decode
from typing import Any

import numpy as np
import pytest
from msgspec.structs import replace

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from fleet.lab import Drive, driven
from safenav.motion.columns import columns_of
from safenav.motion.file import GoalLine, Measured, Motion
from safenav.report.page.motion import RATE, encoded_motion

EAST = 0.6
"""Metres by which every measurement is moved."""


@pytest.fixture(scope="module")
def drive() -> Drive:
    return driven(goals=("spot",))


def moved(motion: Motion, metres: float) -> Motion:
    """The motion whose robots were measured farther east."""
    lines = [
        replace(line, rows=tuple(replace(row, x=row.x + metres) for row in line.rows))
        if isinstance(line, Measured)
        else line
        for line in motion.lines
    ]
    return replace(motion, lines=tuple(lines))


def unpacked(names: list[str], data: str) -> dict[str, np.ndarray[Any, Any]]:
    """The columns of packed data, in metres and radians."""
    table = np.array(json.loads(zlib.decompress(b64decode(data)))).cumsum(axis=1) / 1000
    return dict(zip(names, table, strict=True))


def test_a_body_is_where_it_was_measured_and_its_ghost_where_the_plan_is(drive: Drive) -> None:
    data = encoded_motion(moved(drive.motion, EAST))
    for track, name in zip(data["tracks"], drive.motion.header.robots, strict=True):
        body = unpacked(track["columns"], track["data"])
        ghost = unpacked(track["ghost"]["columns"], track["ghost"]["data"])
        if name == "spot":  # its ghost stands at the goal that it has
            goals = [line for line in drive.motion.lines if isinstance(line, GoalLine)]
            index = int(RATE * (goals[-1].t0 + 0.2))
            assert abs(ghost["x"][index] - goals[-1].x) < 2e-3
            continue
        plan = columns_of(drive.motion, name, RATE, in_world=False, planned=True)
        planned = plan.place[0]
        assert np.abs(ghost["x"] - planned).max() < 2e-3
        assert np.abs(body["x"] - ghost["x"] - EAST).max() < 0.1
        if name == "digit":
            for foot in ("lx", "rx"):  # the whole body is moved
                assert np.abs(body[foot] - ghost[foot] - (body["x"] - ghost["x"])).max() < 3e-3
