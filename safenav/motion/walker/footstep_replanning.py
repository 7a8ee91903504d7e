"""The least change of feet and of leaning that still leads to the goal: a quadratic programme.

Unknowns are, for each phase, how far its foot is off the plan and how far the centre of pressure
is off its foot. Four equations say that the goal is met (safenav.motion.pendulum), inequalities
that feet keep their order, their reach and their regions.
"""

from __future__ import annotations

from itertools import pairwise
from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray

from safenav.extras import missing
from safenav.motion.file.records import Foothold
from safenav.motion.pendulum import Array, miss
from safenav.motion.walker.courses import WalkPlan

AHEAD, ASIDE = 0.0599, 0.0299
"""Metres by which the centre of pressure may leave the middle of a foot, along it and across."""
BESIDE = 0.17
"""The same across both feet, when both are on the ground."""
STEP, LATERAL = 0.645, 0.151
"""Longest step and least lateral distance of the feet in metres."""
DIRECTIONS = 24
"""Sides of the polygon that stands for the circle of the longest step."""
EDGE = 0.12
"""Metres of a foot's middle inside its regions."""
FARTHEST = 0.25
"""Metres by which a foot may be placed off its plan."""
HURRY = 1.0
"""Metres per second by which a foot in the air may be sent elsewhere."""
LEAN, DIVERGENT, CONVERGENT = 0.5, 400.0, 20.0
"""Costs of leaning (a foot's placing costs 1), and of a goal that is missed."""
OPTIMAL = 1
EQUAL = 5


def replaced(plan: WalkPlan, state: Array, omega: float, soft: bool) -> tuple[Array, Array] | None:
    """Offsets of the feet and of the centres of pressure (phases, 2 each); None if there are
    none. ``soft``: the goal may be missed, and the last foot be placed elsewhere."""
    count = len(plan.durations)
    missed, effect = miss(plan.durations, plan.pressures, state, plan.goal, omega)
    last = plan.same[-1]
    moved = [
        i
        for i in range(1, count)
        if plan.same[i] == i and (i not in plan.fixed or (soft and i == last))
    ]
    first_of = {phase: 2 * at for at, phase in enumerate(moved)}
    places = {i: first_of[plan.same[i]] for i in range(count) if plan.same[i] in first_of}
    leans = 2 * len(moved)
    misses = leans + 2 * count
    size = misses + (4 if soft else 0)
    cost = np.concatenate([np.ones(leans), np.full(2 * count, LEAN)])
    if soft:
        cost = np.concatenate([cost, [DIVERGENT, CONVERGENT] * 2])
    bound = np.zeros(size)
    turns = [_turned(foot or plan.feet[0]) for foot in plan.feet]
    for phase, at in places.items():
        reach = min(FARTHEST, HURRY * plan.lift) if phase == 1 else FARTHEST
        bound[at : at + 2] = reach
    for phase, foot in enumerate(plan.feet):
        at = leans + 2 * phase
        bound[at : at + 2] = (AHEAD, ASIDE) if foot is not None else (AHEAD, BESIDE)
    bound[misses:] = 1e30
    rows = np.zeros((4, size))
    for phase in range(count):
        lean = turns[phase]
        for axis in (0, 1):
            for row, share in ((axis, effect.diverging), (2 + axis, effect.converging)):
                if phase in places:
                    rows[row, places[phase] + axis] += share[phase]
                at = leans + 2 * phase
                rows[row, at : at + 2] += share[phase] * lean[axis]
    if soft:
        for axis in (0, 1):
            rows[axis, misses + 2 * axis] = effect.decay
            rows[2 + axis, misses + 2 * axis + 1] = -1.0
    scale = np.array([1 / max(effect.diverging.max(), 1e-9)] * 2 + [1.0, 1.0])
    rows, wanted = rows * scale[:, None], missed.ravel() * scale
    sides, most = _steps(plan, places, size)
    rows_all = np.vstack([rows, sides])
    upper = np.concatenate([bound, wanted, most])
    lower = np.concatenate([-bound, wanted, np.full(len(most), -1e30)])
    sense = np.zeros(len(upper), dtype=np.int32)
    sense[size : size + 4] = EQUAL
    found, flag = _solved(np.diag(cost), np.zeros(size), rows_all, upper, lower, sense)
    if flag != OPTIMAL:
        return None
    offsets, pushes = np.zeros((count, 2)), np.zeros((count, 2))
    for phase, at in places.items():
        offsets[phase] = found[at : at + 2]
    for phase in range(count):
        at = leans + 2 * phase
        pushes[phase] = turns[phase] @ found[at : at + 2]
    return offsets, pushes


def _turned(foot: Foothold | None) -> Array:
    yaw = foot.yaw if foot is not None else 0.0
    return np.array([[cos(yaw), -sin(yaw)], [sin(yaw), cos(yaw)]])


def _steps(plan: WalkPlan, places: dict[int, int], size: int) -> tuple[Array, Array]:
    """Rows and upper bounds: lateral order, longest step, and the corridor."""
    rows: list[Array] = []
    most: list[float] = []

    def add(way: Array, after: int, before: int | None, limit: float) -> None:
        row = np.zeros(size)
        if after in places:
            row[places[after] : places[after] + 2] += way
        if before is not None and before in places:
            row[places[before] : places[before] + 2] -= way
        if row.any():
            rows.append(row)
            most.append(limit)

    for phase, (one, other) in enumerate(pairwise(plan.feet), start=1):
        if one is None or other is None or plan.same[phase] != phase:
            continue
        box = plan.boxes[phase]
        step = np.array([other.x - one.x, other.y - one.y])
        yaw = (one.yaw + other.yaw) / 2
        across = np.array([-sin(yaw), cos(yaw)]) * other.side
        add(-across, phase, phase - 1, float(across @ step) - LATERAL)
        for part in range(DIRECTIONS):
            angle = 2 * pi * part / DIRECTIONS
            way = np.array([cos(angle), sin(angle)])
            add(way, phase, phase - 1, STEP * cos(pi / DIRECTIONS) - float(way @ step))
        for way, limit in (
            (np.array([1.0, 0.0]), box.east - EDGE - other.x),
            (np.array([-1.0, 0.0]), other.x - box.west - EDGE),
            (np.array([0.0, 1.0]), box.north - EDGE - other.y),
            (np.array([0.0, -1.0]), other.y - box.south - EDGE),
        ):
            add(way, phase, None, limit)
    if not rows:
        return np.zeros((0, size)), np.zeros(0)
    return np.array(rows), np.array(most)


def _solved(
    cost: Array, slope: Array, rows: Array, upper: Array, lower: Array, sense: NDArray[np.int32]
) -> tuple[Array, int]:
    try:
        import daqp
    except ImportError as error:
        raise missing("recovery from pushes", "daqp", "motion") from error
    found, _, flag, _ = daqp.solve(cost, slope, rows, upper, lower, sense)
    return np.asarray(found), int(flag)
