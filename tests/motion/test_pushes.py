"""Pushes: the walker stays upright, in its regions, within the limits in the file.

Among the tests 500 of them; `make fuzz` tries thousands.
"""

import os
import random
from functools import cache
from itertools import pairwise
from math import cos, pi, sin

import numpy as np
import pytest

from motion.runs import trace_of
from motion.test_walking import walker, wandering
from motion.walking import lateral_order, longest_step, mass, swing_path
from safenav.errors import UsageError
from safenav.motion.check.verdict import check_motion
from safenav.motion.file.reading import parsed, text_of
from safenav.motion.file.records import BodyPush, Segment
from safenav.motion.geometry import Box
from safenav.motion.making import Disturbances, motion_of
from safenav.motion.walker.courses import Actual, PendingMove
from safenav.motion.walker.recovery import recovered, struck

PUSHES = int(os.environ.get("SAFENAV_FUZZ", "500"))
FIRST = int(os.environ.get("SAFENAV_FUZZ_FIRST", "0"))
SIZE = 0.15


def regions(segment: Segment) -> Box:
    floor = walker().floor
    boxes = [floor.box(region) for region in (segment.origin, segment.to)]
    return Box(
        min(b.west for b in boxes),
        min(b.south for b in boxes),
        max(b.east for b in boxes),
        max(b.north for b in boxes),
    )


@cache
def trials() -> list[list[Segment]]:
    """Each a move until a blow of full size at a random instant, the rest of it, and the move
    after it from where that one really ended."""
    chance = random.Random(FIRST + 2)
    omega = walker().gait.omega
    walks = [
        s for s in wandering(walker(), 3 * PUSHES, seed=FIRST + 4) if s.primitive[:4] == "walk"
    ]
    pairs = [(a, b) for a, b in pairwise(walks) if a.t1 == b.t0]
    found = []
    for one, other in pairs[:PUSHES]:
        here, after = PendingMove(one, regions(one)), PendingMove(other, regions(other))
        way, instant = chance.uniform(0, 2 * pi), chance.uniform(0.02, one.t1 - one.t0 - 0.02)
        blow = (SIZE * cos(way), SIZE * sin(way))
        first, _, second = struck(here, after, instant, blow, omega)
        last = second.feet[-1]
        if second.goal == one.goal and (last.x, last.y) == (one.feet[-1].x, one.feet[-1].y):
            third = other
        else:
            actual = Actual(np.array(second.goal), (last.x, last.y))
            third = recovered(after, actual, None, omega)
        found.append([first, second, third])
    assert len(found) == PUSHES
    return found


@pytest.mark.slow
def test_blows_of_15_cm_per_second_0_falls_all_feet_inside() -> None:
    omega = walker().gait.omega
    for first, second, third in trials():
        for segment in (first, second, third):
            path, box = mass(segment, omega, per_phase=12), regions(segment)
            ends = np.concatenate([path["c"][[0, -1]], path["v"][[0, -1]]], axis=1)
            np.testing.assert_allclose(ends[0], segment.start, atol=1e-8)
            np.testing.assert_allclose(ends[1], segment.goal, atol=1e-8)
            assert np.hypot(*(path["c"] - path["p"]).T).max() / 0.8 < 0.5
            assert lateral_order(segment) >= 0.15
            assert longest_step(segment) <= 0.65
            points = np.array([[foot.x, foot.y] for foot in segment.feet])
            assert (points >= [box.west + 0.11, box.south + 0.11]).all()
            assert (points <= [box.east - 0.11, box.north - 0.11]).all()
            assert (path["c"] >= [box.west + 0.3, box.south + 0.3]).all()
            assert (path["c"] <= [box.east - 0.3, box.north - 0.3]).all()
            assert all(swing_path(swing)[1].max() <= 3.0 for swing in segment.swings)


def test_centre_of_pressure_stays_under_the_foot() -> None:
    for _, second, _ in trials()[:100]:
        for phase, foot in zip(second.phases, second.feet, strict=True):
            dx, dy = phase.x - foot.x, phase.y - foot.y
            assert abs(dx * cos(foot.yaw) + dy * sin(foot.yaw)) <= 0.06
            assert abs(dy * cos(foot.yaw) - dx * sin(foot.yaw)) <= 0.03


@pytest.mark.parametrize("seed", [1, 3])
def test_run_under_blows_is_accepted_by_the_checker(seed: int) -> None:
    name = "two_digits"
    made = motion_of(trace_of(name), None, Disturbances(seed, push=SIZE))
    made = parsed(text_of(made).encode(), "pushed")
    assert sum(1 for line in made.lines if isinstance(line, BodyPush)) > 100
    assert check_motion(made, trace_of(name)) == []


def test_blow_that_the_file_does_not_tell_is_refused() -> None:
    name = "two_digits"
    made = motion_of(trace_of(name), None, Disturbances(1, push=SIZE))
    lines = list(made.lines)
    lines.remove(next(line for line in lines if isinstance(line, BodyPush)))
    hidden = parsed(text_of(type(made)(made.header, tuple(lines), made.outcome)).encode(), "f")
    found = check_motion(hidden, trace_of(name))
    assert any("its velocity jumps by" in finding.found for finding in found)


def test_pushes_that_no_walker_could_withstand_are_reported() -> None:
    name = "two_digits"
    with pytest.raises(UsageError, match="falls at t = "):
        motion_of(trace_of(name), None, Disturbances(1, push=1.0))
