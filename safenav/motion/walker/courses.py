"""The rest of a walker's move, from its actual state: the phases of one or two moves."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from safenav.motion.file.records import Foothold, PressurePhase, Segment
from safenav.motion.geometry import Box
from safenav.motion.pendulum import Array

LATE = 0.06
"""Seconds before landing within which a foot can no longer be redirected."""


class Actual(Struct, frozen=True):
    """Actual state of a walker: its mass, and its foot on the ground."""

    state: Array
    foot: tuple[float, float]


class PendingMove(Struct, frozen=True):
    """A move that is still to be walked, and its regions."""

    segment: Segment
    box: Box


class WalkPlan(Struct, frozen=True):
    """Phases still to come: durations and centres of pressure, the foothold of each (None: both
    feet are down), which of these are one and the same, the regions of each, and the first of
    them that must stay where they are. ``lift``: seconds until the foot in the air lands."""

    durations: Array
    pressures: Array
    feet: tuple[Foothold | None, ...]
    same: tuple[int, ...]
    boxes: tuple[Box, ...]
    fixed: frozenset[int]
    goal: Array
    lift: float


def plan_of(
    courses: list[PendingMove], actual: Actual, sooner: float, step: int, hold: bool
) -> WalkPlan | None:
    """The phases of some moves, the landing after phase ``step`` ``sooner`` seconds earlier (later
    if negative), for which the later phases of the first move last longer; None if it cannot.
    ``hold``: the foot in the air is not redirected."""
    durations: list[float] = []
    feet: list[Foothold | None] = []
    same: list[int] = []
    boxes: list[Box] = []
    fixed = {0}
    for number, course in enumerate(courses):
        segment = course.segment
        walking = segment.primitive != "stop"
        for index, phase in enumerate(segment.phases):
            joined = number > 0 and index == 0
            same.append(same[-1] if joined else len(durations))
            if not walking and not joined:
                fixed.add(len(durations))
            durations.append(phase.seconds)
            feet.append(segment.feet[index] if walking or index < 2 else None)
            boxes.append(course.box)
        if walking and number == len(courses) - 1:
            fixed.add(same[-1])
    count = len(courses[0].segment.phases)
    if sooner and (count < step + 3 or durations[step] - sooner < LATE):
        return None
    if sooner:
        durations[step] -= sooner
        for index in range(step + 1, count - 1):
            durations[index] += sooner / (count - 2 - step)
    lift = durations[0]
    if (lift < LATE or hold) and len(durations) > 1:
        fixed.add(1)
    first = feet[0]
    assert first is not None
    feet[0] = replace(first, x=actual.foot[0], y=actual.foot[1])
    where = [
        (foot.x, foot.y) if foot is not None else (phase.x, phase.y)
        for foot, phase in zip(feet, _phases(courses), strict=True)
    ]
    goal = np.array(courses[-1].segment.goal)
    return WalkPlan(
        np.array(durations),
        np.array(where),
        tuple(feet),
        tuple(same),
        tuple(boxes),
        frozenset(fixed),
        goal,
        lift,
    )


def _phases(courses: list[PendingMove]) -> list[PressurePhase]:
    return [phase for course in courses for phase in course.segment.phases]
