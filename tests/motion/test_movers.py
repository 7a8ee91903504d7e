"""Guarantees of movers: exact joins, dynamics, clearance, feet that stay apart, flights through
centres, and steps that take as long as their pace predicts; the order of runs by any pace."""

import os
import random
import re
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from msgspec import convert, json
from msgspec.structs import replace
from numpy.polynomial.polynomial import polyder

from motion.runs import SHIPPED
from motion.test_check import trace_of
from safenav import Clock, Trace, check_motion, motion_of, read_trace
from safenav.motion import walker as primitives
from safenav.motion.check.examination import Finding
from safenav.motion.check.order import disorder
from safenav.motion.check.verdict import joined
from safenav.motion.check.walk import shape_of, walked
from safenav.motion.file import Moving, Segment, limits_of
from safenav.motion.flyer import HORIZON, AxisTracker
from safenav.motion.geometry import HEADINGS, MetricFloor, quintic, turn, values
from safenav.motion.making import mover
from safenav.motion.mover import Mover
from safenav.motion.timing import dated, in_time, ordered, paces_of
from safenav.pace.gait import Walker, gait_on
from safenav.pace.robot import ACTION, Pace, acted_by, pace_of, resolved
from safenav.trace import records

SIZE, MIDDLE = 60, 60 * 30 + 30
SLOWED = int(os.environ.get("SAFENAV_MOTION_SLOWED", "10"))
MOVES = int(os.environ.get("SAFENAV_MOTION_MOVES", "10000"))


def robot(kind: str, side: float, speed: float | None = None) -> Mover:
    """A robot at rest in the middle of a large floor, facing east."""
    figures = resolved(kind, None, speed, "ground")
    assert figures is not None
    return mover("r", MetricFloor(SIZE, SIZE, side), MIDDLE, "east", figures)


def limits_on(side: float) -> Any:
    """The parameters and limits of a walker, as in the header of a motion."""
    values = robot("walker", side).values
    return {**values, **limits_of(values["height"])}


def beside(moved: Mover, chance: random.Random) -> int:
    """A region beside its own; a walker does not turn around."""
    ways = [h for h in HEADINGS if moved.kind != "walker" or turn(moved.heading or h, h) != 2]
    row, col = divmod(moved.region, SIZE)
    ahead = {h: (row + HEADINGS[h].step[0], col + HEADINGS[h].step[1]) for h in ways}
    heading = chance.choice([h for h in ways if all(0 <= at < SIZE for at in ahead[h])])
    return ahead[heading][0] * SIZE + ahead[heading][1]


def wandering(side: float, moves: int, seed: int) -> list[Any]:
    """Random moves of a walker, straight on or a quarter turn, with stops and starts between."""
    chance, moved = random.Random(seed), robot("walker", side)
    found: list[Moving] = []
    for tick in range(1, moves + 1):
        if chance.random() < 0.1:
            found += moved.halt(tick)
            if chance.random() < 0.5:
                found += moved.rest(tick, moved.time + chance.uniform(0.1, 3))
        found += moved.move(tick, beside(moved, chance))
    return found


def every_primitive(side: float) -> list[Segment]:
    """Three of each primitive, from a walk that is long enough to hold them all."""
    found: dict[str, list[Segment]] = {}
    for segment in wandering(side, 400, seed=1):
        found.setdefault(segment.primitive, []).append(segment)
    ways = ("straight", "left", "right")
    wanted = {"stop", "stand", *(f"{kind} {way}" for kind in ("walk", "start") for way in ways)}
    assert set(found) == wanted
    return [segment for segments in found.values() for segment in segments[:3]]


def test_ten_thousand_random_moves_join_without_a_jump() -> None:
    found = wandering(2.7, MOVES, seed=7)
    gaps = [np.abs(np.subtract(one.goal, other.start)).max() for one, other in pairwise(found)]
    assert max(gaps) < 1e-9
    assert all(before.t1 == after.t0 for before, after in pairwise(found))


def test_a_quintic_has_the_given_position_speed_and_acceleration_at_both_ends() -> None:
    path = quintic(1.6, 0.3, -0.2, 1.1, 0.5, 0.7, -0.9)
    for order, ends in enumerate(((0.3, 1.1), (-0.2, 0.5), (0.7, -0.9))):
        found = [values(polyder(path, order), t) for t in (0.0, 1.6)]
        assert found == pytest.approx(ends)


@pytest.mark.parametrize("side", [1.8, 2.4, 2.7, 3.0, 3.7, 4.4, 6.0])
def test_a_walker_keeps_its_limits_on_regions_of_any_size(side: float) -> None:
    """Each move, and each join of two moves, obeys the rules of the checker, with room to spare."""
    limits = limits_on(side)
    wrong: list[Any] = []
    case: Any = SimpleNamespace(wrong=lambda *found: wrong.append(found))
    floor, found = MetricFloor(SIZE, SIZE, side), wandering(side, 200, seed=2)
    for segment in [*every_primitive(side), *found[:20]]:
        moved = walked(segment, limits)
        wrong += moved.broken
        feet = np.array([[foot.x, foot.y] for foot in segment.feet])
        rims = np.array(floor.corridor(segment.origin, segment.to))
        for points, room in ((moved.mass.states[:, :2], 0.3), (feet, 0.25), (moved.places, 0.25)):
            if points.size:
                assert min((points - rims[:2]).min(), (rims[2:] - points).min()) >= room - 1e-9
    for before, after in pairwise(found):
        joined(case, before, after)
    assert wrong == []


def test_segments_of_the_same_shape_have_the_same_motion() -> None:
    """The check solves and judges one of them."""
    limits = limits_on(2.7)
    known: dict[bytes, Any] = {}
    for segment in wandering(2.7, 60, seed=3):
        own, shape = walked(segment, limits), shape_of(segment)
        other = known.setdefault(shape, own)
        pairs = (own.mass.states[:, :2], other.mass.states[:, :2]), (own.places, other.places)
        for mine, its in pairs:
            moved = other.moved(segment, its.reshape(-1, 2))
            np.testing.assert_allclose(moved, mine.reshape(-1, 2), atol=1e-8)
    assert 6 <= len(known) < 20
    data = json.decode(json.encode(segment))
    shapes = ("phases", "feet", "swings", "turning", "start", "goal", "t1")
    text = json.encode({key: data[key] for key in shapes}).decode()
    numbers = [*re.finditer(r"-?\d+\.\d+(e-?\d+)?", text)]
    for number in numbers:
        more = f"{text[: number.start()]}{float(number[0]) + 1e-6}{text[number.end() :]}"
        other = convert(data | json.decode(more), Segment)
        assert shape_of(other) != shape_of(segment), number
    assert len(numbers) > 50


def test_both_feet_carry_a_walker_long_enough_even_with_very_unequal_steps() -> None:
    gait = gait_on(1.65, Walker(0.3, 0.3, 1.0))
    for primitive in (primitives.walk(gait, way, foot) for way in (0, 1) for foot in (1, -1)):
        carried = sum(hold.up - hold.down for hold in primitive.feet)
        assert 0.15 < carried / primitive.t1 - 1 < 0.25


def test_a_flyer_keeps_its_tilt_limit_and_turns_back_at_the_border() -> None:
    """A flyer nears a border at speed, with a reference beyond it; the last case is unsolvable."""
    given = []
    for place, border in ((0.0, 9.0), (0.0, 0.2), (1e30, 9.0)):
        tracker = AxisTracker(0.0, 3.4)
        tracker.state = np.array([place, 1.0, 0.0, 0.0])
        wanted, low = np.tile([2.0, 0.0, 0.5], (HORIZON, 1)), np.full(HORIZON, -9.0)
        given.append(tracker.command(wanted, low, np.full(HORIZON, border)))
    free, bound, lost = given
    assert free == pytest.approx(3.4) and -3.4 <= bound < 0 and lost == 0.5


@pytest.mark.parametrize("kind", ["walker", "rover", "flyer", "disc"])
@pytest.mark.parametrize("side", [1.9, 2.7, 4.5])
@pytest.mark.parametrize("speed", [0.4, 0.5, 2.0])
def test_steps_and_actions_take_as_long_as_their_motion(
    kind: str, side: float, speed: float
) -> None:
    dice, moved, now = random.Random(f"{kind} {side}"), robot(kind, side, speed), 0.0
    pace = pace_of(resolved(kind, None, speed, "ground"), SIZE, side, "east")
    for tick in range(60):
        if dice.random() < 0.3:
            now += dice.choice([0.5, 5.0])
        if now > moved.time + 1e-9:
            moved.halt(tick)
            moved.rest(tick, max(now, moved.time))
        if dice.random() < 0.2:
            at = moved.region + dice.choice([-1, SIZE])
            now += acted_by([(pace, moved.region)], now, at)
            moved.halt(tick)
            moved.face(tick, at)
            moved.rest(tick, moved.time + ACTION)
            assert moved.time == pytest.approx(now, abs=1e-9)
        to, before = beside(moved, dice), now
        now += pace.step(now, moved.region, to)
        assert now > before
        moved.move(tick, to)
        pace.arrived(now)
        assert moved.time == pytest.approx(now, abs=1e-9)


def test_a_robot_without_motion_takes_one_second_per_tick() -> None:
    assert pace_of(None, SIZE, ticks=2).step(0.0, 40, 41) == 2.0
    assert type(pace_of(resolved("walker", None, None, "ground"), SIZE, 0.5)) is Pace


class Stroller(Pace):
    """Takes one to three seconds for a step, by chance, and sometimes one to halt."""

    chance: random.Random

    def step(self, now: float, origin: int, to: int) -> float:
        return super().step(now, origin, to) - 1.0 + self.chance.uniform(1, 3)

    def _halting(self) -> float:
        return self.chance.choice([0.0, 1.0])


def disordered(trace: Trace, seed: int) -> list[Finding]:
    """What the checker finds in the order of a run by robots of any pace."""
    paces = {}
    for name in trace.robots:
        paces[name] = Stroller(trace.header.scenario.map.cols, 2.7, None)
        paces[name].chance = random.Random(f"{seed} {name}")
    serial = dated(trace, paces)
    moves = [r for r in trace.records if isinstance(r, records.Move) and r.to != r.from_]
    assert len([r for r in serial if isinstance(r, records.Arrive)]) == len(moves)
    return [*disorder(ordered(trace, serial), serial)]


@pytest.mark.parametrize("name", [*SHIPPED, "apart"])
def test_slow_robots_never_overlap_or_enter_a_door_early_and_all_finish(name: str) -> None:
    """Nor are they together in a forbidden zone."""
    trace = read_trace(trace_of(name))
    for seed in range(SLOWED):
        assert disordered(trace, seed) == []


@pytest.mark.parametrize(
    ("name", "rule"),
    [("apart", "overlap"), ("two_digits", "overlap"), ("case_study_1", "obstacle")],
)
def test_a_live_run_that_ignores_conflicts_exclusions_or_obstacles_is_refused(
    name: str, rule: str
) -> None:
    trace = read_trace(trace_of(name))
    scenario = trace.header.scenario
    robots = tuple(replace(each, avoids=frozenset()) for each in scenario.robots)
    heedless = replace(scenario, robots=robots, never_together=())
    heedless = replace(trace, header=replace(trace.header, scenario=heedless))
    timed = in_time(heedless, motion_of(heedless))
    lines = [r for r in timed.records if rule != "obstacle" or not isinstance(r, records.Resolved)]
    header = replace(timed.header, scenario=replace(scenario, clock=Clock.LIVE))
    timed = replace(timed, header=header, records=tuple(lines))
    assert rule in {found.rule for found in check_motion(motion_of(timed), timed)}


@pytest.mark.parametrize(
    ("name", "decision"), [("case_study_1", records.Synthesis), ("two_digits", records.Plan)]
)
def test_a_step_before_the_decision_that_it_follows_is_refused(name: str, decision: type) -> None:
    trace = read_trace(trace_of(name))
    serial = [*dated(trace, paces_of(trace, motion_of(trace).header))]
    timed = ordered(trace, serial)
    at = max(i for i, r in enumerate(serial) if isinstance(r, decision) and (r.t or 0.0) > 0)
    step = next(i for i, r in enumerate(serial) if i > at and isinstance(r, records.Depart))
    serial[step] = replace(serial[step], t=(serial[at].t or 0.0) - 0.1)
    (found,) = disorder(timed, serial)
    assert (found.rule, found.found[:14]) == ("order", "begins 0.100 s")
