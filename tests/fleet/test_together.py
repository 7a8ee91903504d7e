"""Drives in the simulation of robots that resolve what they find: together, or alone."""

import numpy as np
import pytest

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from fleet.lab import driven
from once import beside
from safenav.motion.columns import columns_at
from safenav.motion.file import Action, Reset
from safenav.run.checked import check_trace

YARD = beside(__file__, "scenarios/crate.yaml")
FLEET = beside(__file__, "scenarios/crate.fleet.yaml")


@pytest.mark.parametrize("goals", [(), ("one", "two")], ids=["references", "goals"])
def test_two_robots_lift_a_crate_that_one_of_them_found(goals: tuple[str, ...]) -> None:
    drive = driven(YARD, FLEET, goals)
    outcome = drive.trace.outcome
    assert outcome is not None and outcome.outcome == "completed"
    lifts = [line for line in drive.motion.lines if isinstance(line, Action)]
    assert {line.robot for line in lifts} == {"one", "two"}
    # Its lidar has looked before it sets out: it does not run into the crate.
    assert not [line for line in drive.motion.lines if isinstance(line, Reset)]
    assert len({(line.t0, line.t1) for line in lifts}) == 1
    assert check_trace(drive.lines).findings == () and drive.judged() == []


CORRIDOR = beside(__file__, "scenarios/corridor.yaml")
CLOSED = beside(__file__, "scenarios/corridor.fleet.yaml")


@pytest.mark.parametrize("goals", [(), ("one",)], ids=["reference", "goals"])
def test_a_robot_opens_the_door_that_it_found_alone(goals: tuple[str, ...]) -> None:
    """It enters without a request, since it can open it, and then has to."""
    drive = driven(CORRIDOR, CLOSED, goals)
    outcome = drive.trace.outcome
    assert outcome is not None and outcome.outcome == "completed"
    (push,) = [line for line in drive.motion.lines if isinstance(line, Action)]
    assert (push.action, push.obstacle) == ("push", "door@12")
    if not goals:  # a reference ends before the door, in the first half of its region
        assert columns_at(drive.motion, "one", np.array([push.t0])).place[0] < 8.9
    assert check_trace(drive.lines).findings == () and drive.judged() == []


FLAT = beside(__file__, "scenarios/flat.yaml")
SWAPS = beside(__file__, "scenarios/flat.fleet.yaml")


def test_a_robot_gets_a_battery_in_a_drive() -> None:
    """Obstacles of flat robots were made in simulated worlds only, and in rehearsals."""
    drive = driven(FLAT, SWAPS)
    assert drive.trace.outcome is not None and drive.trace.outcome.outcome == "completed"
    (swap,) = [line for line in drive.motion.lines if isinstance(line, Action)]
    assert (swap.robot, swap.action, swap.obstacle) == ("quad", "sense", "empty@17")
    assert check_trace(drive.lines).findings == () and drive.judged() == []


def test_the_motion_of_a_drive_that_ends_immediately_is_clean() -> None:
    drive = driven(CORRIDOR.replace("[[1, 6]]", "[[1, 1]]"), CLOSED)
    assert drive.trace.outcome is not None and drive.trace.outcome.outcome == "completed"
    assert drive.judged() == []
