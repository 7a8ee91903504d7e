"""A drive whose crate two robots lift together, in the simulation."""

import pytest

pytest.importorskip("mujoco", reason="the simulation needs the extra 'simulation'")

from fleet.drives import driven
from safenav.audit.check import check_trace
from safenav.motion.file.records import Action, Reset

YARD = """\
safenav: 1
name: yard
map: {resolution: 2.0, grid: ["######", "#....#", "#.##.#", "#....#", "######"]}
robots:
  one: {model: mir250, start: [1, 1], objective: {visit: [[1, 3]]}}
  two: {model: mir250, start: [3, 4], objective: {visit: [[2, 4]]}}
until: {rounds: 1}
"""
FLEET = """\
safenav-fleet: 1
transport: simulation
simulation: {pace: 1000, obstacles: [{type: crate, region: [1, 2]}]}
defaults: {speed: 1.0, scan: {obstacle: crate}, act: {lift: grip}, follow: {}}
"""


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
