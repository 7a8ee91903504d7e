"""A robot takes as long as the motion of its kind does, whatever it does before."""

import random
import subprocess
import sys

import pytest

from safenav.motion.geometry import MetricFloor
from safenav.motion.making import mover
from safenav.motion.mover import Crossing
from safenav.pace.robot import Pace, acted_by, pace_of
from safenav.scenario.motion import resolved

COLS, ROWS = 9, 9
STEPS = {"east": 1, "north": -COLS, "west": -1, "south": COLS}
OPPOSITE = {"east": "west", "west": "east", "north": "south", "south": "north"}


@pytest.mark.parametrize("kind", ["walker", "rover", "flyer", "disc"])
@pytest.mark.parametrize("side", [1.9, 2.7, 4.5])
def test_steps_and_actions_take_as_long_as_their_motion(kind: str, side: float) -> None:
    dice = random.Random(f"{kind} {side}")
    motion = resolved(kind, None, None, "ground")
    assert motion is not None
    floor, at, heading, now = MetricFloor(ROWS, COLS, side), 40, "east", 0.0
    moved = mover("r", floor, at, heading, motion)
    pace = pace_of(motion, COLS, side, heading)
    for tick in range(60):
        if dice.random() < 0.3:
            now += dice.choice([0.5, 5.0])
        if now > moved.time + 1e-9:
            moved.halt(tick)
            moved.rest(tick, max(now, moved.time))
        if dice.random() < 0.2:
            beside = at + dice.choice([-1, COLS])
            now += acted_by([(pace, at)], now, beside)
            moved.halt(tick)
            moved.face(tick, beside)
            moved.rest(tick, moved.time + pace.acting)
            assert moved.time == pytest.approx(now, abs=1e-9)
        ways = [w for w in STEPS if w != OPPOSITE[heading] or kind != "walker"]
        inner = [w for w in ways if divmod(at + STEPS[w], COLS)[0] in range(1, ROWS - 1)]
        heading = dice.choice([w for w in inner if (at + STEPS[w]) % COLS not in (0, COLS - 1)])
        to = at + STEPS[heading]
        seconds = pace.step(now, at, to)
        moved.move(Crossing(tick, at, to, heading))
        now, at = now + seconds, to
        pace.arrived(now)
        assert moved.time == pytest.approx(now, abs=1e-9)


def test_a_robot_of_unknown_motion_takes_a_second_a_tick() -> None:
    pace = pace_of(None, COLS, ticks=2)
    assert pace.step(0.0, 40, 41) == 2.0
    small = pace_of(resolved("walker", None, None, "ground"), COLS, 0.5)
    assert type(small) is Pace


def test_the_runtime_gets_durations_without_numpy() -> None:
    code = "import sys, safenav.runtime.worlds.live_simulation; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
