"""The walking plan on a floor with contact and friction, in MuJoCo, with feedback.

A reduced model: a heavy body, and two light feet that the legs push apart along the line between
them, as in the pendulum. A stance leg carries the body at its height, a swing leg follows its
plan, unilateral contact and friction decide whether the foot holds. The feedback is that of the
divergent component: each landing is shifted by how far the body is off its plan, and the leg's
line of force by up to 4 cm, as an ankle would. The body does not rotate. It shows that the plan can
be followed by such a body, and nothing about a real robot.
"""

from math import hypot, inf

import numpy as np
import pytest

from motion.test_walking import SIZE, walker
from safenav.motion.columns import sample
from safenav.motion.file import Segment
from safenav.motion.mover import Crossing

mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install '.[dev]'")

STEP = 0.001
MASS, FOOT = 45.0, 0.4
OMEGA = (9.81 / 0.8) ** 0.5
SCENE = f"""
<mujoco>
  <option timestep="{STEP}" gravity="0 0 -9.81" integrator="implicitfast"/>
  <worldbody>
    <geom type="plane" size="200 200 1" friction="0.8 0.005 0.0001"/>
    <body name="mass" pos="0 0 0.8">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
      <joint type="slide" axis="0 0 1"/>
      <geom type="sphere" size="0.1" mass="{MASS}" contype="0" conaffinity="0"/>
    </body>
    <body name="left" pos="0 0 0.02">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
      <joint type="slide" axis="0 0 1"/>
      <geom type="sphere" size="0.02" mass="{FOOT}" friction="0.8 0.005 0.0001"/>
    </body>
    <body name="right" pos="0 0 0.02">
      <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
      <joint type="slide" axis="0 0 1"/>
      <geom type="sphere" size="0.02" mass="{FOOT}" friction="0.8 0.005 0.0001"/>
    </body>
  </worldbody>
</mujoco>
"""
FALLEN = 0.6
"""Metres off the plan from which no leg still reaches the ground."""
WAYS = ["east"] * 4 + ["north"] * 3 + ["west"] * 3
"""Ten regions with two turns."""
NEXT = {"east": 1, "north": -SIZE, "west": -1}


def planned() -> list[Segment]:
    """Start, ten regions with two turns, stop."""
    mover, found = walker(), []
    found += mover.rest(0, 0.5)
    for tick, way in enumerate(WAYS, start=1):
        found += mover.move(Crossing(tick, mover.region, mover.region + NEXT[way], way))
    found += mover.halt(len(WAYS))
    return [segment for segment in found if isinstance(segment, Segment)]


def walked(feedback: bool) -> tuple[float, float]:
    """How far the body is off its plan at the ends of moves at most, and how low it gets (m)."""
    model = mujoco.MjModel.from_xml_string(SCENE)
    data = mujoco.MjData(model)
    limits = walker().limits()
    segments = planned()
    first = sample(segments[0], np.array([0.0]), limits)[0]
    data.qpos[:] = np.concatenate([first[0:2], [0.0], first[12:14], [0.0], first[16:18], [0.0]])
    shift = {1: [0.0, 0.0], -1: [0.0, 0.0]}
    worst, lowest = 0.0, 0.8
    for segment in segments:
        times = np.arange(0.0, segment.t1 - segment.t0, STEP)
        rows = sample(segment, times, limits)
        for row in rows.tolist():
            stance = [side for side, at in ((1, 14), (-1, 18)) if row[at] <= 1e-9]
            place = data.qpos.tolist()
            data.qfrc_applied = _legs(place, data.qvel.tolist(), row, stance, shift, feedback)
            mujoco.mj_step(model, data)
            x, y, z = data.qpos[:3].tolist()
            lowest = min(lowest, 0.8 + z)
            if hypot(x - row[0], y - row[1]) > FALLEN:
                return inf, lowest
        goal = np.array(segment.goal[:2])
        worst = max(worst, hypot(*(data.qpos[:2] - goal)))
    return worst, lowest


def _legs(
    place: list[float],
    speed: list[float],
    row: list[float],
    stance: list[int],
    shift: dict[int, list[float]],
    feedback: bool,
) -> list[float]:
    """Forces of the legs on the body and the feet. Numbers, no arrays: there are 15,000 steps."""
    off = [place[k] - row[k] + (speed[k] - row[3 + k]) / OMEGA for k in (0, 1)]
    lift = MASS * (9.81 - 400 * place[2] - 40 * speed[2])
    forces = [0.0, 0.0, lift]
    for k in (0, 1):
        pressure = row[9 + k] + sum(shift[side][k] for side in stance) / len(stance)
        if feedback:
            pressure += _within(1.6 * off[k], 0.04)
        forces[k] = lift * (place[k] - pressure) / 0.8
    share = -1.0 / len(stance)
    for side, at in ((1, 12), (-1, 16)):
        if side in stance:
            forces += [share * force for force in forces[:3]]
            continue
        if feedback:
            shift[side] = [0.9 * _within(off[k], 0.12) for k in (0, 1)]
        wanted = [row[at] + shift[side][0], row[at + 1] + shift[side][1], row[at + 2]]
        dof = len(forces)
        forces += [
            FOOT * (2500 * (wanted[k] - place[dof + k]) - 90 * speed[dof + k]) for k in (0, 1, 2)
        ]
        forces[dof + 2] += FOOT * 9.81
    return forces


def _within(value: float, most: float) -> float:
    return max(-most, min(value, most))


@pytest.mark.slow
def test_body_with_feedback_walks_ten_regions_with_two_turns_and_a_stop() -> None:
    off, lowest = walked(feedback=True)
    assert lowest > 0.75
    assert off < 0.01


def test_open_loop_replay_falls() -> None:
    """What contact leaves of the plan diverges without feedback: the test is no formality."""
    assert walked(feedback=False)[0] == inf
