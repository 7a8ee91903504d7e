"""A motion beside the trace that it carries out, the rules that it was found to break, and the
space that bodies occupy: each piece of motion as samples of discs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import ceil, floor, hypot, inf

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from safenav.errors import UsageError
from safenav.motion.file import Action, Flight, Motion, Moving, Numbers, Reset, Segment, Swing
from safenav.motion.geometry import values
from safenav.motion.timing.execution import in_conflict
from safenav.motion.walker.primitives import Mass, mass
from safenav.trace.reading import Trace

Array = NDArray[np.float64]
Swinging = tuple[Array, Array, Array]

STEP = 0.02
"""Seconds between samples of a body."""
MOST_SAMPLES = 5_000_000
"""Samples of one piece of motion: more than a day."""


class Disc(Struct, frozen=True):
    """A moving disc: times since the start of the motion (n), centres (n, 2), radius, and what it
    is."""

    what: str
    radius: float
    times: Array
    centres: Array


def grid(seconds: float, step: float = STEP) -> Array:
    """Times from 0 to the end, at most a step apart.

    Raises UsageError for a duration that no file of safenav has: its samples would fill the memory.
    """
    if not seconds < MOST_SAMPLES * STEP:
        most = f"expected at most {MOST_SAMPLES * STEP:,.0f} s"
        raise UsageError(f"the motion has a piece of {seconds:,.0f} s; {most}")
    count = max(1, ceil(seconds / step))
    return np.arange(count + 1, dtype=np.float64) * (seconds / count)


def discs(
    piece: Moving, radius: float, foot: float, walked: tuple[Mass, Swinging] | None
) -> list[Disc]:
    """The discs that a piece moves: the body, and of a walker its feet, of radius ``foot``, on the
    ground and in the air."""
    if isinstance(piece, Segment) and walked is not None:
        return _walking(piece, radius, foot, *walked)
    times, centres = [], []
    begin = piece.t0
    assert isinstance(piece, Flight)
    for part in piece.parts:
        t = grid(part.seconds, _step(part.x, part.y))
        times.append(begin + t)
        centres.append(np.stack([values(part.x, t), values(part.y, t)], axis=1))
        begin += part.seconds
    return [Disc("body", radius, np.concatenate(times), np.concatenate(centres))]


def _step(*coefficients: Numbers) -> float:
    """Return the seconds between samples; a body at rest needs only two."""
    return STEP if any(len(axis) > 1 for axis in coefficients) else float("inf")


def walk(segment: Segment, omega: float) -> Mass:
    """The centre of mass of a segment, at most ``STEP`` apart and at the ends of its phases."""
    ends = np.cumsum([phase.seconds for phase in segment.phases])
    still = segment.start == segment.goal and len(segment.phases) == 1
    times = np.sort(np.append(grid(float(ends[-1]), inf if still else STEP), ends[:-1]))
    return mass(segment.phases, segment.start, segment.goal, times, omega)


def swing_states(swings: Sequence[Swing]) -> Swinging:
    """Feet in the air, at most ``STEP`` apart: times since the segment's start (swings, n),
    positions (swings, n, 2) and speeds (swings, n): quintics by their Hermite form."""
    begin, end = np.array([[swing.t0, swing.t1] for swing in swings]).reshape(-1, 2).T
    seconds = end - begin
    longest = float(seconds.max(initial=STEP))
    u = grid(longest) / longest
    scale = np.stack([np.ones_like(seconds), seconds, seconds**2] * 2, axis=1)
    states = np.array([(*swing.start, *swing.goal) for swing in swings]).reshape(-1, 6, 3)
    ends = states[:, :, :2] * scale[:, :, None]
    place, speed = np.zeros((2, len(swings), len(u), 2))
    for coefficient in np.moveaxis(_HERMITE.T[::-1] @ ends, 1, 0)[:, :, None]:
        speed *= u[:, None]
        speed += place
        place *= u[:, None]
        place += coefficient
    times = begin[:, None] + seconds[:, None] * u
    return times, place, np.hypot(speed[:, :, 0], speed[:, :, 1]) / seconds[:, None]


_HERMITE = np.array(
    [
        (1, 0, 0, -10, 15, -6),
        (0, 1, 0, -6, 8, -3),
        (0, 0, 0.5, -1.5, 1.5, -0.5),
        (0, 0, 0, 10, -15, 6),
        (0, 0, 0, -4, 7, -3),
        (0, 0, 0, 0.5, -1, 0.5),
    ]
)
"""Rows: contribution of each boundary value of a quintic (position, speed, acceleration; start,
goal) to its coefficients, over a unit of time."""


def _walking(
    segment: Segment, radius: float, foot: float, path: Mass, swinging: Swinging
) -> list[Disc]:
    found = [Disc("body", radius, segment.t0 + path.times, path.states[:, :2])]
    if segment.feet:
        ends = [(t, hold.x, hold.y) for hold in segment.feet for t in (hold.down, hold.up)]
        feet = np.array(ends)
        found.append(Disc("foot", foot, segment.t0 + feet[:, 0], feet[:, 1:]))
    if segment.swings:
        times, places, _ = swinging
        found.append(Disc("swinging foot", foot, segment.t0 + times.ravel(), places.reshape(-1, 2)))
    return found


NEAR = 1e-7
"""Tolerance for the rounding of a file, in metres, seconds and radians."""
MOST_CELLS = 1000
"""Maximum number of regions that one piece of motion may cross in each direction."""
STILL = 1e-6
"""Metres that a body at rest may move by rounding."""


class Finding(Struct, frozen=True):
    """A broken rule: time (seconds), robot, rule, and what was found in metres and seconds."""

    t: float
    robot: str
    rule: str
    found: str

    def __str__(self) -> str:
        who = f"{self.robot}: " if self.robot else ""
        return f"t = {self.t:.3f} s: {who}{self.found} [{self.rule}]"


class Holding(Struct, frozen=True):
    """A robot has reserved a region from ``begin`` to ``end`` (seconds)."""

    robot: str
    region: int
    begin: float
    end: float


class Grid(Struct, frozen=True):
    """The map as the checker sees it."""

    rows: int
    cols: int
    side: float

    def place(self, region: int) -> tuple[int, int]:
        """Column from the west, row from the south."""
        row, col = divmod(region, self.cols)
        return col, self.rows - 1 - row

    def region(self, cell: tuple[int, int]) -> int:
        """The region at a place."""
        return (self.rows - 1 - cell[1]) * self.cols + cell[0]

    def distance(self, points: Array, cell: tuple[int, int]) -> Array:
        """Return the distance of each point (n, 2) to a cell; 0 inside it."""
        west, south = cell[0] * self.side, cell[1] * self.side
        dx = np.maximum(0.0, np.maximum(west - points[:, 0], points[:, 0] - west - self.side))
        dy = np.maximum(0.0, np.maximum(south - points[:, 1], points[:, 1] - south - self.side))
        apart: Array = np.hypot(dx, dy)
        return apart

    def cells(self, points: Array, radius: float) -> Iterable[tuple[int, int]]:
        """All cells that discs of this radius around the points could touch.

        Raises UsageError for a piece of motion far off the map: too many cells to examine."""
        low = (points.min(axis=0) - radius) / self.side
        high = (points.max(axis=0) + radius) / self.side
        if not (high - low).max() < MOST_CELLS:
            raise UsageError(
                f"the motion has a piece across {(high - low).max():.6g} regions; "
                f"expected less than {MOST_CELLS}"
            )
        for col in range(floor(low[0]), floor(high[0]) + 1):
            for row in range(floor(low[1]), floor(high[1]) + 1):
                yield col, row


class Examination:
    """A motion, its trace, and the ``findings`` so far. ``pieces``: of each robot in the order of
    the file; ``numbers``: of each robot in the header; ``held``: the reservations."""

    def __init__(self, motion: Motion, trace: Trace) -> None:
        header = motion.header
        self.motion, self.trace, self.obstacles = motion, trace, trace.obstacles
        self.findings: list[Finding] = []
        self.pieces = {name: motion.of(Moving, name) for name in header.robots}
        self.actions = motion.of(Action)
        self.numbers = {
            name: {key: float(v) for key, v in own.items() if isinstance(v, int | float)}
            for name, own in header.robots.items()
        }
        self.driven = {name: own for name, own in header.robots.items() if "driven" in own}
        """The robots that were physically driven; none in a motion that is only computed."""
        self.resets = {(reset.robot, reset.t) for reset in motion.of(Reset)}
        """The robots and times at which the plan of a driven robot is cut off."""
        self.makespan = motion.outcome.makespan
        self.grid = Grid(header.rows, header.cols, header.side)
        self.held: list[Holding] = []
        self._walks: dict[int, tuple[Mass, Swinging]] = {}
        self._discs: dict[int, list[Disc]] = {}

    def wrong(self, t: float, robot: str, rule: str, found: str) -> None:
        """Report that a rule is broken."""
        self.findings.append(Finding(t, robot, rule, found))

    def in_conflict(self, one: str, other: str) -> bool:
        return in_conflict(self.trace.header.scenario.robots, one, other)

    def radius(self, robot: str) -> float:
        """The radius of the disc that its body fits in, in metres."""
        return self.numbers[robot].get("size", 0.0) / 2

    def walk(self, segment: Segment) -> tuple[Mass, Swinging]:
        """The centre of mass of a walker and its feet in the air, computed once."""
        if id(segment) not in self._walks:
            moved = walk(segment, self.numbers[segment.robot]["omega"])
            self._walks[id(segment)] = moved, swing_states(segment.swings)
        return self._walks[id(segment)]

    def discs(self, piece: Moving) -> list[Disc]:
        """The discs that a piece moves, computed once."""
        if id(piece) not in self._discs:
            walked = self.walk(piece) if isinstance(piece, Segment) else None
            own = self.numbers[piece.robot]
            foot = hypot(own.get("sole_length", 0.0), own.get("sole_width", 0.0)) / 2
            self._discs[id(piece)] = discs(piece, self.radius(piece.robot), foot, walked)
        return self._discs[id(piece)]

    def body(self, robot: str, begin: float, end: float) -> Array:
        """The centres of a body (n, 2) between two times, by the pieces of motion between them."""
        found = [np.empty((0, 2))]
        for piece in self.pieces[robot]:
            if piece.t0 < end - NEAR and piece.t1 > begin + NEAR:
                path = self.discs(piece)[0]
                inside = (path.times >= begin - NEAR) & (path.times <= end + NEAR)
                found.append(path.centres[inside])
        return np.concatenate(found)

    def places(self, robot: str, times: Array) -> Array:
        """The middle of a body (n, 2) at some times."""
        bodies = [self.discs(piece)[0] for piece in self.pieces[robot]]
        samples = np.concatenate([body.times for body in bodies])
        centres = np.concatenate([body.centres for body in bodies])
        order = np.argsort(samples, kind="stable")
        columns = [np.interp(times, samples[order], centres[order, axis]) for axis in (0, 1)]
        return np.stack(columns, axis=1)
