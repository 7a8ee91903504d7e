"""The linear inverted pendulum in closed form, and the primitives of walker motion.

A centre of mass ``c`` at constant height h above flat ground, pushed by a centre of pressure ``p``,
moves by ``c'' = omega^2 (c - p)`` with ``omega = sqrt(g / h)``, in both x and y. Its state splits
into ``xi = c + c'/omega`` (the divergent component, or capture point) and ``eta = c - c'/omega``.
While p moves linearly at the rate ``omega r``, ``xi - p - r`` grows by ``e^(omega t)`` and ``eta -
p + r`` shrinks by ``e^(-omega t)``. So this module computes eta forwards from the start and xi
backwards from the goal. Shooting from one side would multiply every rounding error by e^(omega T),
10^7 over one move.

Sources: Englsberger, Ott, Albu-Schaeffer (T-RO 2015) for the divergent component; the linear
problem of a whole move is our own.

States are arrays ``[x, y, vx, vy]`` in metres and metres per second; times are seconds. The centre
of pressure of n phases is a path through n + 1 knots (n + 1, 2), linear in each phase.

Primitives are planned once, each in its own frame: the walker enters its region at the origin and
heads along x. A *walking pose* is at apex, one step length inside, on the centre line, at the
gait's speed, with the other foot in mid-air. A *standing pose* is at rest two lengths inside with
both feet on the ground. Every primitive leads exactly from one such pose to another, so primitives
compose without limit. No error accumulates, since each begins at the pose of an absolute region.

Phase-space intersections give the times of the steps (safenav.pace.gait), as if the mass changed
feet in an instant. Around each such instant both feet are on the ground. The centre of pressure
moves from one to the other at constant speed, as in the linear problem that places the feet.
"""

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from math import cos, pi, sin

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from safenav.errors import UsageError
from safenav.motion.check.walk import walked
from safenav.motion.file import (
    Foothold,
    FootState,
    Moving,
    PressurePhase,
    Segment,
    Swing,
    limits_of,
)
from safenav.motion.geometry import MetricFloor, transformed, turn, unit_vector
from safenav.motion.mover import Mover
from safenav.pace.gait import Apex, Gait, Stride, gait_on, starting, stopping, walking
from safenav.pace.robot import AT_ONCE, YAW

Array = NDArray[np.float64]


def divergent(state: Array, omega: float) -> Array:
    """Return the divergent component (xi) of a state: a foothold there brings the mass to rest."""
    return state[:2] + state[2:] / omega


def convergent(state: Array, omega: float) -> Array:
    """Return the convergent component (eta) of a state."""
    return state[:2] - state[2:] / omega


def placed(
    durations: Array,
    nodes: Array,
    knots: NDArray[np.int64],
    start: Array,
    goal: Array,
    weights: Array,
    omega: float,
) -> Array:
    """Return the nodes nearest to the given ones that lead exactly from start to goal.

    ``nodes`` (m, 2): feet and other points of pressure; ``knots`` (phases + 1): the node at each
    knot; ``weights`` (m): each node's freedom to move (0: fixed; at least two are free). Along each
    axis the solution meets two well-scaled equations at least cost.
    """
    ends = np.cumsum(durations)
    late, early = np.exp(-omega * (ends - durations)), np.exp(-omega * (ends[-1] - ends))
    decay = np.exp(-omega * durations)
    mean = (1 - decay) / (omega * durations)
    rows = np.zeros((2, len(nodes)))
    for row, share, near, far in (
        (0, late, 1 - mean, mean - decay),
        (1, early, mean - decay, 1 - mean),
    ):
        np.add.at(rows[row], knots[:-1], share * near)
        np.add.at(rows[row], knots[1:], share * far)
    whole = np.exp(-omega * ends[-1])
    ends_at = np.array(
        [
            divergent(start, omega) - whole * divergent(goal, omega),
            convergent(goal, omega) - whole * convergent(start, omega),
        ]
    )
    spread = rows * weights
    moved: Array = nodes + spread.T @ np.linalg.solve(spread @ rows.T, ends_at - rows @ nodes)
    return moved


LEFT, RIGHT = 1, -1

DOUBLE, LEAST_DOUBLE = 0.2, 0.16
"""Share of a step (of the shorter of two unequal steps) with both feet on the ground; its minimum
for each step of a move."""
SETTLING = 4
"""Phases in which the mass settles between the feet."""
SNAP = 0.5
"""A swing foot leaves the ground with this share of a cubic's acceleration, since a quintic without
acceleration there would be faster halfway."""


@lru_cache(maxsize=512)
def walk(gait: Gait, turn: int, foot: int) -> Segment:
    """Return the walk from a walking pose, with ``foot`` on the ground, to one in the next
    region."""
    return _stepping(f"walk {_WORDS[turn]}", gait, walking(gait, turn, foot), turn)


@lru_cache(maxsize=512)
def start(gait: Gait, turn: int, foot: int) -> Segment:
    """Return the segment from a standing pose to a walking pose in the next region. ``foot``: the
    stance foot at the end of a straight start (a turn determines it)."""
    return _stepping(f"start {_WORDS[turn]}", gait, starting(gait, turn, foot), turn)


@lru_cache(maxsize=64)
def stop(gait: Gait, foot: int) -> Segment:
    """Return the segment from a walking pose to a standing pose: the walker steps onto the capture
    point and closes its feet; its mass settles between them."""
    omega, offset, length = gait.omega, gait.walker.foot, gait.length
    step, close, *settling = stopping(gait)
    place, half = 2 * length, DOUBLE / 2 * min(2 * step, close)
    rest = sum(settling) / SETTLING
    durations = np.array([step - half, 2 * half, close - half, *[rest] * SETTLING])
    nodes = np.array([[length, foot * offset], [place, -foot * offset], *[[place, 0.0]] * SETTLING])
    goal = np.array([place, 0.0, 0.0, 0.0])
    begin = _walking(gait, length, foot)
    knots, weights = np.array([0, 0, 1, *range(1, SETTLING + 2)]), np.ones(SETTLING + 2)
    weights[[0, 1, -1]] = 0.0
    nodes = placed(durations, nodes, knots, begin, goal, weights, omega)
    closed, end = step + close, float(durations.sum())
    footholds = (
        Foothold(length, foot * offset, 0.0, foot, 0.0, step + half),
        Foothold(place, -foot * offset, 0.0, -foot, step - half, end),
        Foothold(place, foot * offset, 0.0, foot, closed, end),
    )
    leaving, landed, beside = footholds
    passing = _passing(gait, length, 0.0, 0.0, -foot)
    swings = (_landing(passing, landed), _swing(leaving, beside))
    phases = _phases(durations, nodes[knots])
    return _local("stop", phases, footholds, swings, begin, goal)


def stand(gait: Gait, seconds: float) -> Segment:
    """Return a segment in which the walker stands for some seconds."""
    x, offset = 2 * gait.length, gait.walker.foot
    rest = np.array([x, 0.0, 0.0, 0.0])
    feet = tuple(Foothold(x, side * offset, 0.0, side, 0.0, seconds) for side in (LEFT, RIGHT))
    return _local("stand", (PressurePhase(seconds, x, 0.0, x, 0.0),), feet, (), rest, rest)


def _local(
    name: str,
    phases: tuple[PressurePhase, ...],
    feet: tuple[Foothold, ...],
    swings: tuple[Swing, ...],
    start: Array,
    goal: Array,
    turning: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
) -> Segment:
    """Return a segment of these parts in its own frame, from time 0 on."""
    seconds = sum(phase.seconds for phase in phases)
    about = ("", 0, name, 0, 0, 0.0, seconds, phases, feet, swings, turning)
    return Segment(*about, tuple(start.tolist()), tuple(goal.tolist()))


def stance(segment: Segment) -> int:
    """Return the foot on the ground at the end of a segment; 0 if both feet are."""
    end = segment.t1 - segment.t0 - AT_ONCE
    return sum(foot.side for foot in segment.feet if foot.up > end)


def _phases(durations: Array, pressures: Array) -> tuple[PressurePhase, ...]:
    """Return the phases of a centre of pressure on these points (phases + 1, 2)."""
    ends = pairwise(pressures.tolist())
    return tuple(
        PressurePhase(s, *a, *b) for s, (a, b) in zip(durations.tolist(), ends, strict=True)
    )


_WORDS = {0: "straight", LEFT: "left", RIGHT: "right"}


def _stepping(name: str, gait: Gait, stride: Stride, turn: int) -> Segment:
    """Return the segment of a stride. A standing walker first leans onto the first foot."""
    omega, offset, line = gait.omega, gait.walker.foot, stride.line
    standing = stride.lean > 0
    nodes = np.array([apex.stance(offset) for apex in line])
    weights = np.ones(len(line))
    weights[0] = weights[-1] = 0.0
    steps = np.array(stride.durations)
    switches = stride.lean + np.cumsum(steps)[:-1]
    steps[[0, -1]] *= 2  # steps on the first and last foot are half as long
    shorter = np.minimum(steps[:-1], steps[1:])
    share = max(DOUBLE, LEAST_DOUBLE * (stride.seconds - stride.lean) / float(shorter.sum()))
    half = share / 2 * shorter
    downs, ups = np.array([0.0, *(switches - half)]), np.array([*(switches + half), stride.seconds])
    times = [0.0, *np.stack([switches - half, switches + half], axis=1).ravel(), stride.seconds]
    knots = np.repeat(np.arange(len(line)), 2)
    if standing:
        middle, count = [[line[0].x, 0.0]] * 2, len(line)
        nodes, weights = np.concatenate([nodes, middle]), np.concatenate([weights, [0.0, 1.0]])
        knots = np.array([count, count + 1, *knots])
        times[1:1] = [stride.lean / 2, stride.lean]
    durations = np.diff(times)
    first, last = line[0], line[-1]
    begin = np.array([first.x, 0.0, 0.0, 0.0]) if standing else _walking(gait, first.x, first.foot)
    goal = _placed_walking(gait, last)
    nodes = placed(durations, nodes, knots, begin, goal, weights, omega)
    arc = [index for index, apex in enumerate(line) if 0 < abs(apex.yaw) < pi / 2]
    bounds = [stride.lean, *switches, stride.seconds]
    turning = (0.0, turn * pi / 2, 0.0, 0.0)
    if arc:
        turning = (*turning[:2], float(bounds[arc[0]]), float(bounds[arc[-1] + 2]))
    footholds = tuple(
        Foothold(x, y, apex.yaw, apex.foot, down, up)
        for apex, (x, y), down, up in zip(
            line, nodes[: len(line)].tolist(), downs.tolist(), ups.tolist(), strict=True
        )
    )
    if standing:  # the other foot is symmetric to it
        aside = (first.x, -first.foot * offset, 0.0, -first.foot, 0.0, stride.lean)
        footholds = (Foothold(*aside), *footholds)
    swings = _swings(gait, line, footholds, stride.seconds, standing)
    return _local(name, _phases(durations, nodes[knots]), footholds, swings, begin, goal, turning)


def _swings(
    gait: Gait, line: Sequence[Apex], holds: tuple[Foothold, ...], end: float, standing: bool
) -> tuple[Swing, ...]:
    """Return the swings between the footholds. At a walking pose one foot is halfway."""
    swings = []
    first, last, before = line[0], line[-1], holds[-2]
    if not standing:
        passing = _passing(gait, first.x, first.y, first.yaw, holds[1].side)
        swings.append(_landing(passing, holds[1]))
    swings += [_swing(*pair) for pair in zip(holds, holds[2:], strict=False)]
    passing = _passing(gait, last.x, last.y, last.yaw, before.side)
    seconds = end - before.up
    ahead = (passing[0] - before.x, passing[1] - before.y)
    leaving = _lifted(before, ahead, 3 * SNAP / seconds**2)
    swings.append(Swing(before.side, before.up, end, 0.0, 0.5, leaving, passing))
    return tuple(swings)


def _landing(passing: FootState, hold: Foothold) -> Swing:
    """Return the second half of a swing, from the walking pose to a foothold."""
    behind = (passing[0] - hold.x, passing[1] - hold.y)
    goal = _lifted(hold, behind, 3 * SNAP / hold.down**2)
    return Swing(hold.side, 0.0, hold.down, 0.5, 1.0, passing, goal)


def _swing(before: Foothold, after: Foothold) -> Swing:
    """Return a swing between two footholds."""
    ahead = (after.x - before.x, after.y - before.y)
    pull = 6 * SNAP / (after.down - before.up) ** 2
    start, goal = _lifted(before, ahead, pull), _lifted(after, ahead, -pull)
    return Swing(before.side, before.up, after.down, 0.0, 1.0, start, goal)


def _lifted(hold: Foothold, ahead: tuple[float, float], pull: float) -> FootState:
    """Return the state of a foot that leaves or reaches the ground: at rest, accelerated along
    ``ahead``."""
    return (hold.x, hold.y, hold.yaw, 0.0, 0.0, 0.0, ahead[0] * pull, ahead[1] * pull, 0.0)


def _passing(gait: Gait, x: float, y: float, yaw: float, side: int) -> FootState:
    """Return the swing foot's state as it passes the stance foot in the periodic gait."""
    offset = side * gait.walker.foot
    speed = (1.875 - 0.375 * SNAP) * 2 * gait.length / (gait.seconds * (1 - DOUBLE))
    along = (cos(yaw), sin(yaw))
    place = (x - offset * along[1], y + offset * along[0], yaw)
    return (*place, speed * along[0], speed * along[1], 0.0, 0.0, 0.0, 0.0)


def _walking(gait: Gait, x: float, foot: int) -> Array:
    """Return the state of the mass at a walking pose on the centre line along x."""
    return np.array([x, foot * gait.sway, gait.speed, 0.0])


def _placed_walking(gait: Gait, apex: Apex) -> Array:
    ahead = np.array([cos(apex.yaw), sin(apex.yaw)])
    aside = np.array([-ahead[1], ahead[0]]) * apex.foot * gait.sway
    return np.concatenate([np.array([apex.x, apex.y]) + aside, ahead * gait.speed])


class WalkerMover(Mover):
    """A walker. ``foot``: the foot on the ground at a walking pose; 0 if the walker stands."""

    def begin(self) -> None:
        self.heading, self.foot = self.heading or "east", 0
        try:
            self.gait = gait_on(self.floor.side, self.figures.walker)
        except UsageError as error:
            raise UsageError(f"{self.robot}: {error}") from error

    @property
    def _facing(self) -> str:
        assert self.heading is not None, "a walker has one"
        return self.heading

    def move(self, tick: int, to: int, *, short: bool = False) -> list[Moving]:  # noqa: ARG002
        heading = self.floor.heading(self.region, to)
        quarters = turn(self._facing, heading)
        if self.foot:
            primitive = walk(self.gait, quarters, self.foot)
        else:
            primitive = start(self.gait, quarters, LEFT)
        return [self._carried_out(primitive, tick, to, heading)]

    def halt(self, tick: int) -> list[Moving]:
        if not self.foot:
            return []
        stopped = stop(self.gait, self.foot)
        return [self._carried_out(stopped, tick, self.region, self._facing)]

    def rest(self, tick: int, until: float) -> list[Moving]:
        assert not self.foot, "a walker in mid-step cannot rest"
        still = stand(self.gait, until - self.time)
        return [self._carried_out(still, tick, self.region, self._facing, until)]

    def _carried_out(
        self, primitive: Segment, tick: int, to: int, heading: str, until: float | None = None
    ) -> Segment:
        end = self.time + primitive.t1 if until is None else until
        placed = entered(primitive, self.floor, self.region, self._facing)
        about = {"robot": self.robot, "tick": tick, "origin": self.region, "to": to}
        self.region, self.heading, self.foot = to, heading, stance(primitive)
        begin, self.time = self.time, end
        return replace(placed, **about, t0=begin, t1=end)


def entered(primitive: Segment, floor: MetricFloor, region: int, heading: str) -> Segment:
    """Return a primitive in the frame of the map, for a walker that enters a region with this
    heading through the centre of one side."""
    ahead = complex(*unit_vector(heading))
    corner = complex(*floor.centre(region)) - ahead * floor.side / 2
    return transformed(primitive, corner, ahead, YAW[heading])


@lru_cache(maxsize=64)
def fault_of(gait: Gait) -> str | None:
    """Return, in words, the first rule that the segments of a gait break, or None."""
    height = gait.walker.height
    limits = {"height": height, **limits_of(height)}
    try:
        made = [stop(gait, LEFT), walk(gait, LEFT, RIGHT)]
        for quarters in (0, LEFT, RIGHT):
            made += [walk(gait, quarters, LEFT), start(gait, quarters, LEFT)]
    except ValueError:  # in an arc step, the mass never passes over the foot
        return "the mass would fall back on an arc"
    found = (words for each in made for _, _, words in walked(each, limits).broken)
    return next(found, None)
