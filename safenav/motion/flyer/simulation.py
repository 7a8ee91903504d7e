"""A flyer in gusty wind: what its tracking makes of its references, at every instant."""

from __future__ import annotations

import random
from collections.abc import Sequence
from math import exp, hypot, sqrt

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.errors import UsageError
from safenav.motion.file.records import Curve, Flight, FlownTrack
from safenav.motion.flyer.body import DRAG, RATE, STEP, Body
from safenav.motion.flyer.tracking import HORIZON, AxisTracker
from safenav.motion.flyer.tracking import STEP as PERIOD
from safenav.motion.geometry import MetricFloor
from safenav.motion.polynomial import derivative, values
from safenav.pace.robot import PEAK_ACCELERATION

Array = NDArray[np.float64]

CALM = 1.5
"""Seconds after which a gust is another one."""
NOISE = 0.005
"""Metres: spread of the measured position."""
STRONGEST = 2.0
"""Times the root mean square of the wind that the tilt limit has to withstand."""
ROWS = 200
"""Samples of one line of a file."""
DIGITS = 6
CLIMB, SINK = 9.0, 5.0
"""Stiffness and damping with which it keeps its altitude."""


class SampledReference(Struct, frozen=True):
    """The reference as it was sampled: rows of position, velocity, acceleration in x and y; the
    altitude; the yaw; and the box that the middle of the body may be in."""

    states: Array
    altitude: Array
    yaw: Array
    boxes: Array


def check_gust(robot: str, gust: float, tilt: float, speed: float, side: float) -> None:
    """Raises UsageError for wind that the tilt limit cannot withstand beside the reference."""
    seconds = 1.875 * side / speed
    flying = min(PEAK_ACCELERATION * side / seconds**2, tilt / 2)
    need = DRAG * STRONGEST * gust + flying
    if need > tilt:
        most = (tilt - flying) / (DRAG * STRONGEST)
        raise UsageError(
            f"{robot}: gusts of {gust:g} m/s need {need:.1f} m/s^2, beyond its tilt limit of "
            f"{tilt:g} m/s^2\n    at most {most:.1f} m/s: --gust, or 'tilt' of its model"
        )


def flown(
    flights: Sequence[Flight], floor: MetricFloor, size: float, tilt: float, gust: float, seed: str
) -> list[FlownTrack]:
    """How a flyer follows its flights, which have no gaps, in gusts of ``gust`` m/s (root mean
    square). Deterministic by the seed."""
    count = int((flights[-1].t1 - flights[0].t0) / PERIOD + 1e-9)
    sight = _sampled(flights, floor, size, count + HORIZON + 1)
    chance = random.Random(seed)
    first = sight.states[0]
    body = Body([*first[:2], float(sight.altitude[0])], float(sight.yaw[0]))
    trackers = [AxisTracker(float(first[i]), tilt) for i in (0, 1)]
    wind = [0.0, 0.0]
    keep = exp(-STEP / CALM)
    fresh = gust * sqrt(1 - keep**2)
    rows, errors = [_row(body, wind)], [0.0]
    for step in range(count):
        ahead = slice(step + 1, step + 1 + HORIZON)
        pull = []
        for i, tracker in enumerate(trackers):
            tracker.observe(body.place[i] + chance.gauss(0, NOISE))
            wanted = sight.states[ahead][:, [i, i + 2, i + 4]]
            boxes = sight.boxes[ahead]
            pull.append(tracker.command(wanted, boxes[:, i], boxes[:, i + 2]))
        for _ in range(round(PERIOD * RATE)):
            wind = [keep * air + fresh * chance.gauss(0, 1) for air in wind]
            climb = CLIMB * (sight.altitude[step] - body.place[2]) - SINK * body.velocity[2]
            body.advance(
                (pull[0], pull[1], float(climb)), float(sight.yaw[step]), (wind[0], wind[1])
            )
        rows.append(_row(body, wind))
        off = sight.states[step + 1, :2]
        errors.append(round(hypot(body.place[0] - off[0], body.place[1] - off[1]), DIGITS))
    begin, robot = flights[0].t0, flights[0].robot
    return [
        FlownTrack(
            robot,
            flights[0].tick,
            begin + at * PERIOD,
            PERIOD,
            tuple(rows[at : at + ROWS]),
            tuple(errors[at : at + ROWS]),
        )
        for at in range(0, len(rows), ROWS)
    ]


def _row(body: Body, wind: Sequence[float]) -> tuple[float, ...]:
    numbers = (*body.place, *body.velocity, *body.attitude, *body.rates, body.thrust, *wind)
    return tuple(round(number, DIGITS) for number in numbers)


def _sampled(
    flights: Sequence[Flight], floor: MetricFloor, size: float, count: int
) -> SampledReference:
    """The references at the steps of the tracking; after the end it stays where it is."""
    times = flights[0].t0 + PERIOD * np.arange(count)
    ends = np.array([flight.t1 for flight in flights])
    which = np.minimum(np.searchsorted(ends, times, side="right"), len(flights) - 1)
    states, altitude, yaw = np.zeros((count, 6)), np.zeros(count), np.zeros(count)
    boxes = np.zeros((count, 4))
    for index, flight in enumerate(flights):
        chosen = which == index
        begin = flight.t0
        for curve in flight.curves:
            inside = chosen & (times >= begin - 1e-12)
            since = np.minimum(times[inside] - begin, curve.seconds)
            states[inside] = _states(curve, since)
            altitude[inside], yaw[inside] = values(curve.z, since), values(curve.yaw, since)
            begin += curve.seconds
        box = floor.corridor(flight.origin, flight.to, size / 2)
        boxes[chosen] = (box.west, box.south, box.east, box.north)
    return SampledReference(states, altitude, yaw, boxes)


def _states(curve: Curve, since: Array) -> Array:
    columns = []
    paths = (curve.x, curve.y)
    for _ in range(3):
        columns += [values(path, since) for path in paths]
        paths = (derivative(paths[0]), derivative(paths[1]))
    return np.stack(columns, axis=1)
