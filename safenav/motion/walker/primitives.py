"""The primitives of a walker's motion, each planned once in its own frame.

Local frame: the walker enters its region at the origin, heading along x. A *walking pose* is at
apex, one step length inside, on the centre line, at the gait's speed, the other foot in mid-air; a
*standing pose* is at rest two lengths inside with both feet on the ground. Every primitive leads
exactly from one such pose to another, so primitives compose without limit and no error accumulates:
each begins at the pose of an absolute region.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import cos, pi, sin

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from safenav.motion.file.records import Foothold, FootState, Swing
from safenav.motion.pendulum import Array, placed
from safenav.pace.gait import Apex, Gait, Stride, starting, stopping, walking

LEFT, RIGHT = 1, -1

STILL = (0.0,) * 6
"""Velocities and accelerations of a foot on the ground."""


class Primitive(Struct, frozen=True):
    """A move in its local frame. ``pressures`` (phases, 2): the centre of pressure, constant
    in each phase; ``start``, ``goal``: states of the mass; ``turn``: quarter turns to the left;
    ``turning``: when the body turns; ``foot``: the stance foot at the end, 0 if it stands."""

    name: str
    durations: Array
    pressures: Array
    start: Array
    goal: Array
    footholds: tuple[Foothold, ...]
    swings: tuple[Swing, ...]
    turn: int
    turning: tuple[float, float]
    foot: int

    @property
    def seconds(self) -> float:
        return float(self.durations.sum())


@lru_cache(maxsize=512)
def walk(gait: Gait, turn: int, foot: int) -> Primitive:
    """Walk from walking pose to walking pose of the next region, beginning on ``foot``."""
    return _stepping(f"walk {_WORDS[turn]}", gait, walking(gait, turn, foot), turn)


@lru_cache(maxsize=512)
def start(gait: Gait, turn: int, foot: int) -> Primitive:
    """Start from standing pose to walking pose of the next region; of a straight start ``foot`` is
    the stance foot at the end, of a turn the arc decides."""
    return _stepping(f"start {_WORDS[turn]}", gait, starting(gait, turn, foot), turn)


@lru_cache(maxsize=64)
def stop(gait: Gait, foot: int) -> Primitive:
    """Stop from walking pose to standing pose: a step onto the capture point, then the feet close,
    and the mass settles between them."""
    omega, offset, length = gait.omega, gait.walker.foot, gait.length
    durations = np.array(stopping(gait))
    step, close = stopping(gait)[:2]
    place = 2 * length
    pressures = np.array(
        [[length, foot * offset], [place, -foot * offset], [place, 0.0], [place, 0.0]]
    )
    goal = np.array([place, 0.0, 0.0, 0.0])
    begin = _walking(gait, length, foot)
    weights = np.array([0.0, 0.0, 1.0, 1.0])
    pressures = placed(durations, pressures, begin, goal, weights, omega)
    closed, end = step + close, float(durations.sum())
    footholds = (
        Foothold(length, foot * offset, 0.0, foot, 0.0, step),
        Foothold(place, -foot * offset, 0.0, -foot, step, end),
        Foothold(place, foot * offset, 0.0, foot, closed, end),
    )
    resting, landed, beside = (_at_rest(hold) for hold in footholds)
    swings = (
        Swing(-foot, 0.0, step, 0.5, 1.0, _passing(gait, length, 0.0, 0.0, -foot), landed),
        Swing(foot, step, closed, 0.0, 1.0, resting, beside),
    )
    return Primitive("stop", durations, pressures, begin, goal, footholds, swings, 0, (0.0, 0.0), 0)


def stand(gait: Gait, seconds: float) -> Primitive:
    """Stand at rest."""
    x, offset = 2 * gait.length, gait.walker.foot
    rest = np.array([x, 0.0, 0.0, 0.0])
    feet = tuple(Foothold(x, side * offset, 0.0, side, 0.0, seconds) for side in (LEFT, RIGHT))
    where = np.array([[x, 0.0]])
    span = np.array([seconds])
    return Primitive("stand", span, where, rest, rest, feet, (), 0, (0.0, 0.0), 0)


_WORDS = {0: "straight", LEFT: "left", RIGHT: "right"}


def _stepping(name: str, gait: Gait, stride: Stride, turn: int) -> Primitive:
    """Plan the steps of a stride; a standing walker first leans onto the first foot."""
    omega, offset, line = gait.omega, gait.walker.foot, stride.line
    standing = stride.lean > 0
    feet = np.array([apex.stance(offset) for apex in line])
    durations = np.array(stride.durations)
    pressures = feet
    weights = np.ones(len(line))
    weights[0] = weights[-1] = 0.0
    lead = 0
    if standing:
        lead = 2
        middle = np.array([[line[0].x, 0.0]] * lead)
        durations = np.concatenate([[stride.lean / lead] * lead, durations])
        pressures = np.concatenate([middle, feet])
        weights = np.concatenate([np.ones(lead), weights])
    first, last = line[0], line[-1]
    begin = np.array([first.x, 0.0, 0.0, 0.0]) if standing else _walking(gait, first.x, first.foot)
    goal = _placed_walking(gait, last)
    pressures = placed(durations, pressures, begin, goal, weights, omega)
    feet = pressures[lead:]
    times = np.concatenate([[0.0], np.cumsum(durations)])[lead:]
    arc = [index for index, apex in enumerate(line) if 0 < abs(apex.yaw) < pi / 2]
    turning = (float(times[arc[0]]), float(times[arc[-1] + 2])) if arc else (0.0, 0.0)
    footholds = _footholds(line, feet, times, offset if standing else None)
    swings = _swings(gait, line, footholds, times, standing)
    return Primitive(
        name, durations, pressures, begin, goal, footholds, swings, turn, turning, last.foot
    )


def _footholds(
    line: Sequence[Apex], feet: Array, times: Array, aside: float | None
) -> tuple[Foothold, ...]:
    """Return the footholds, in the order of landing; ``aside``: the walker stands at first, with
    its other foot as far on the other side."""
    holds = [
        Foothold(float(x), float(y), apex.yaw, apex.foot, float(times[i]), float(times[i + 1]))
        for i, (apex, (x, y)) in enumerate(zip(line, feet, strict=True))
    ]
    if aside is None:
        return tuple(holds)
    first = replace(holds[0], down=0.0)
    other = Foothold(first.x, -first.side * aside, 0.0, -first.side, 0.0, float(times[0]))
    return (other, first, *holds[1:])


def _swings(
    gait: Gait, line: Sequence[Apex], holds: tuple[Foothold, ...], times: Array, standing: bool
) -> tuple[Swing, ...]:
    """Return the paths of the feet between their holds; at a walking pose a foot is half-way."""
    swings = []
    first, last = line[0], line[-1]
    if not standing:
        second = holds[1]
        passing = _passing(gait, first.x, first.y, first.yaw, second.side)
        swings.append(Swing(second.side, 0.0, second.down, 0.5, 1.0, passing, _at_rest(second)))
    for before, after in zip(holds, holds[2:], strict=False):
        u = (before.side, before.up, after.down, 0.0, 1.0)
        swings.append(Swing(*u, _at_rest(before), _at_rest(after)))
    before = holds[-2]
    passing = _passing(gait, last.x, last.y, last.yaw, before.side)
    swings.append(
        Swing(before.side, before.up, float(times[-1]), 0.0, 0.5, _at_rest(before), passing)
    )
    return tuple(swings)


def _at_rest(hold: Foothold) -> FootState:
    return (hold.x, hold.y, hold.yaw, *STILL)


def _passing(gait: Gait, x: float, y: float, yaw: float, side: int) -> FootState:
    """The swing foot abreast of the stance foot in the periodic gait."""
    offset = side * gait.walker.foot
    speed = 1.875 * 2 * gait.length / gait.seconds
    along = (cos(yaw), sin(yaw))
    place = (x - offset * along[1], y + offset * along[0], yaw)
    return (*place, speed * along[0], speed * along[1], 0.0, 0.0, 0.0, 0.0)


def _walking(gait: Gait, x: float, foot: int) -> Array:
    """The state of the mass at a walking pose on the centre line along x."""
    return np.array([x, foot * gait.sway, gait.speed, 0.0])


def _placed_walking(gait: Gait, apex: Apex) -> Array:
    ahead = np.array([cos(apex.yaw), sin(apex.yaw)])
    aside = np.array([-ahead[1], ahead[0]]) * apex.foot * gait.sway
    return np.concatenate([np.array([apex.x, apex.y]) + aside, ahead * gait.speed])
