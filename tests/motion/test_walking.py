"""Guarantees of a walker on flat ground: exact joins, dynamics, clearance, feet that stay apart."""

import os
import random
from collections.abc import Iterator
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from msgspec import convert, json

from safenav.errors import UsageError
from safenav.motion import walker as primitives
from safenav.motion.check.verdict import joined
from safenav.motion.check.walk import shape_of, walked
from safenav.motion.columns import sample
from safenav.motion.file import Segment
from safenav.motion.geometry import HEADINGS, MetricFloor, derivative, quintic, turn, values
from safenav.motion.mover import Crossing
from safenav.motion.walker import WalkerMover, cut_off
from safenav.pace.gait import Walker, gait_on

VALUES = {"size": 0.6, "speed": 0.45, "height": 0.8, "foot": 0.18, "clearance": 0.12}
SIZE = 60
MOVES = int(os.environ.get("SAFENAV_MOTION_MOVES", "10000"))
STEPS = {"east": (0, 1), "north": (-1, 0), "west": (0, -1), "south": (1, 0)}


def walker(side: float = 2.7, region: int = SIZE * SIZE // 2 + SIZE // 2) -> WalkerMover:
    floor = MetricFloor(SIZE, SIZE, side)
    return WalkerMover("digit", floor, region, "east", VALUES, "walker")


def beside(region: int, heading: str) -> int | None:
    row, col = divmod(region, SIZE)
    down, right = STEPS[heading]
    row, col = row + down, col + right
    return row * SIZE + col if 0 <= row < SIZE and 0 <= col < SIZE else None


def wandering(mover: WalkerMover, moves: int, seed: int) -> list[Segment]:
    """Random moves, straight on or a quarter turn, with stops and starts in between."""
    chance = random.Random(seed)
    found: list[Segment] = []
    for tick in range(1, moves + 1):
        if chance.random() < 0.1:
            found += mover.halt(tick)
            if chance.random() < 0.5:
                found += mover.rest(tick, mover.time + chance.uniform(0.1, 3))
        ways = [heading for heading in HEADINGS if turn(mover.heading, heading) != 2]
        chance.shuffle(ways)
        heading = next(way for way in ways if beside(mover.region, way) is not None)
        found += mover.move(Crossing(tick, mover.region, beside(mover.region, heading), heading))
    return found


def centres(side: float) -> dict[int, np.ndarray]:
    floor = MetricFloor(SIZE, SIZE, side)
    return {region: np.array(floor.centre(region)) for region in range(SIZE * SIZE)}


def every_primitive(side: float) -> list[Segment]:
    """Three of each primitive, from a walk that is long enough to hold them all."""
    found: dict[str, list[Segment]] = {}
    for segment in wandering(walker(side), 400, seed=1):
        found.setdefault(segment.primitive, []).append(segment)
    ways = ("straight", "left", "right")
    wanted = {"stop", "stand", *(f"{kind} {way}" for kind in ("walk", "start") for way in ways)}
    assert set(found) == wanted
    return [segment for segments in found.values() for segment in segments[:3]]


def test_ten_thousand_random_moves_join_exactly_and_nothing_grows() -> None:
    found = wandering(walker(), MOVES, seed=7)
    gaps = [
        float(np.abs(np.subtract(before.goal, after.start)).max())
        for before, after in pairwise(found)
    ]
    assert max(gaps[-1000:]) < 1e-9
    assert max(gaps) < 1e-9
    assert all(before.t1 == after.t0 for before, after in pairwise(found))


def test_a_quintic_has_its_place_speed_and_acceleration_at_both_ends() -> None:
    path = quintic(1.6, 0.3, -0.2, 1.1, 0.5, 0.7, -0.9)
    for order, ends in enumerate(((0.3, 1.1), (-0.2, 0.5), (0.7, -0.9))):
        found = [values(derivative(path, order), t) for t in (0.0, 1.6)]
        assert found == pytest.approx(ends)


@pytest.mark.parametrize("side", [1.8, 2.4, 2.7, 3.0, 3.7, 4.4, 6.0])
def test_walker_keeps_to_its_limits_on_regions_of(side: float) -> None:
    """By the rules of the checker, in each move and from one to the next, with room to spare."""
    limits: Any = walker(side).limits()
    wrong: list[Any] = []
    case: Any = SimpleNamespace(wrong=lambda *found: wrong.append(found))
    where = centres(side)
    found = wandering(walker(side), 200, seed=2)
    for segment in [*every_primitive(side), *found[:20]]:
        moved = walked(segment, limits)
        wrong += moved.broken
        feet = np.array([[foot.x, foot.y] for foot in segment.feet])
        ends = np.array([where[segment.origin], where[segment.to]])
        low, high = ends.min(axis=0) - side / 2, ends.max(axis=0) + side / 2
        for points, room in ((moved.mass.states[:, :2], 0.3), (feet, 0.25), (moved.places, 0.25)):
            if points.size:
                assert min((points - low).min(), (high - points).min()) >= room - 1e-9
    for before, after in pairwise(found):
        joined(case, before, after)
    assert wrong == []


def test_segments_of_one_shape_have_one_motion_and_no_number_is_left_out() -> None:
    """The check solves and judges one of them."""
    limits = walker().limits()
    known: dict[bytes, Any] = {}
    for segment in wandering(walker(), 60, seed=3):
        own, shape = walked(segment, limits), shape_of(segment)
        other = known.setdefault(shape, own)
        pairs = (own.mass.states[:, :2], other.mass.states[:, :2]), (own.places, other.places)
        for mine, its in pairs:
            moved = other.moved(segment, its.reshape(-1, 2))
            np.testing.assert_allclose(moved, mine.reshape(-1, 2), atol=1e-8)
    assert 6 <= len(known) < 20
    data = json.decode(json.encode(segment))
    for path in numbers_of({key: data[key] for key in SHAPE}):
        changed = json.decode(json.encode(segment))
        within = changed
        for step in path[:-1]:
            within = within[step]
        within[path[-1]] += 1e-6
        other = convert(changed, Segment)
        assert shape_of(other) != shape_of(segment), path


SHAPE = ("phases", "feet", "swings", "turning", "start", "goal", "t1")


def numbers_of(data: Any) -> Iterator[list[Any]]:
    """The paths of all numbers that are no whole ones."""
    pairs = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in pairs:
        if isinstance(value, float):
            yield [key]
        elif not isinstance(value, int):
            yield from ([key, *more] for more in numbers_of(value))


@pytest.mark.parametrize(("side", "words"), [(1.2, "1.2 m"), (0.5, "0.5 m"), (1.7, "1.8 m")])
def test_small_regions_are_refused_with_the_reason(side: float, words: str) -> None:
    with pytest.raises(UsageError, match=words):
        walker(side)


def test_both_feet_carry_it_long_enough_also_with_very_unequal_steps() -> None:
    gait = gait_on(1.5, Walker(0.3, 0.3, 1.0))
    for primitive in (primitives.walk(gait, way, foot) for way in (0, 1) for foot in (1, -1)):
        carried = sum(hold.up - hold.down for hold in primitive.feet)
        assert 0.15 < carried / primitive.t1 - 1 < 0.25


def test_a_step_that_is_cut_off_ends_in_the_state_that_the_mass_has_then() -> None:
    mover = walker()
    for segment in every_primitive(2.7):
        for at in np.linspace(0.05, segment.t1 - segment.t0 - 0.05, 17):
            cut = cut_off(segment, float(at), mover.gait.omega)
            row = sample(segment, np.array([at]), mover.limits())[0]
            np.testing.assert_allclose(cut.goal, row[[0, 1, 3, 4]], atol=1e-9)
            last = cut.phases[-1]
            np.testing.assert_allclose((last.to_x, last.to_y), row[10:12], atol=1e-9)
