"""The simulated walker keeps its balance by its feet, within limits, and falls beyond them."""

from math import hypot

import pytest

pytest.importorskip("numpy", reason="references need the extra 'motion'")

import numpy as np

from safenav.fleet.following import mover_of, resting_place
from safenav.fleet.lab.model import REACH, SOLE, BalancedWalk
from safenav.fleet.place import Places
from safenav.fleet.setpoints import Setpoints, reference_of
from safenav.motion.mover import Crossing
from safenav.scenario.reading.loader import load_scenario_text

TEXT = """\
safenav: 1
name: hall
map: {resolution: 2.0, origin: [1.0, 2.0, 0.4], grid: ["#######", "#.....#", "#.....#", "#######"]}
robots: {digit: {model: digit, start: [2, 1], heading: east, objective: {hold: [2, 1]}}}
"""
STEP = 0.005
OMEGA = (9.81 / 0.8) ** 0.5


def reference() -> Setpoints:
    """Straight on, then a turn to the left, with a halt between."""
    scenario = load_scenario_text(TEXT, "hall.yaml")
    assert scenario.map.frame is not None
    places = Places(scenario.map, scenario.map.frame)
    body = mover_of(scenario.robots[0], places)
    x, y, yaw = resting_place(body, places)
    assert places.region(x, y) == 15 and abs(yaw - 0.4) < 1e-9
    pieces = [
        *body.move(Crossing(1, 15, 16, "east")),
        *body.halt(1),
        *body.move(Crossing(2, 16, 9, "north")),
        *body.halt(2),
    ]
    return reference_of(pieces, body.limits(), places.frame)


def walked(push: float, at: float, angle: float = 0.0) -> tuple[float, float, bool]:
    """The most metres off the plan, those at the end, and whether it fell, after a push (m/s)."""
    plan, walk = reference(), BalancedWalk()
    state = np.array([*plan.at(plan.begin)[:2], 0.0, 0.0])
    off, worst, now, struck = 0.0, 0.0, plan.begin, False
    while now < plan.end + 1.0:
        if now >= at and not struck:
            state[2:] += push * np.array([np.cos(angle), np.sin(angle)])
            struck = True
        row = plan.at(now)
        found = walk.pull(state.tolist(), row, plan, now, OMEGA)
        if found is None:
            return worst, off, True
        pull = np.array(found)
        state = np.concatenate(
            [state[:2] + STEP * (state[2:] + STEP / 2 * pull), state[2:] + STEP * pull]
        )
        now += STEP
        off = float(hypot(*(state[:2] - plan.at(now)[:2])))
        worst = max(worst, off)
    return worst, off, False


def test_the_simulated_walker_follows_its_plan() -> None:
    worst, end, fell = walked(0.0, 0.0)
    assert not fell and worst < 0.005 and end < 0.001


@pytest.mark.parametrize("at", [1.0, 2.3, 3.1, 4.4, 9.0])
@pytest.mark.parametrize("angle", [0.0, 2.0, 4.0])
def test_a_push_is_recovered_from_by_the_feet(at: float, angle: float) -> None:
    worst, end, fell = walked(0.1, at, angle)
    assert not fell and 0.005 < worst < 0.2 and end < 0.005


@pytest.mark.parametrize("angle", [0.0, 2.0, 4.0])
def test_a_walker_falls_after_a_hard_push(angle: float) -> None:
    assert walked(1.2, 3.1, angle)[2]
    assert REACH < 0.3 and max(SOLE) < 0.1  # otherwise this test proves nothing
