"""A motion with its trace and findings, and the space that bodies occupy, as sampled discs. The
rules of space: bodies stay inside the regions of their steps and keep their distances."""

from collections.abc import Hashable, Iterator, Sequence
from functools import partial
from itertools import combinations, product
from math import floor, hypot, inf

import numpy as np
from msgspec import Struct

from safenav.data import cached_method
from safenav.errors import UsageError
from safenav.motion import file
from safenav.motion.check.walk import NEAR, STEP, Array, Walked, grid, shape_of, walked
from safenav.motion.columns import sampled
from safenav.motion.geometry import MetricFloor, path
from safenav.trace.file import Trace


class Disc(Struct, frozen=True):
    """A moving disc: times (n) in seconds since the motion's start, centres (n, 2), radius, and a
    name for messages."""

    what: str
    radius: float
    times: Array
    centres: Array


MOST_CELLS = 1000
"""Maximum number of regions that a piece of motion may cross in each direction."""
STILL = 1e-6
"""Tolerance for rounding of a body at rest, in metres."""


class Finding(Struct, frozen=True):
    """A broken rule: time (seconds), robot, rule, and observation in metres and seconds."""

    t: float
    robot: str
    rule: str
    found: str

    def __str__(self) -> str:
        who = f"{self.robot}: " if self.robot else ""
        return f"t = {self.t:.3f} s: {who}{self.found} [{self.rule}]"


class Holding(Struct, frozen=True):
    """The reservation of a region by a robot from ``begin`` to ``end`` (seconds)."""

    robot: str
    region: int
    begin: float
    end: float


class Grid(MetricFloor, frozen=True):
    """The map and the cells beyond it."""

    def place(self, region: int) -> tuple[int, int]:
        """Return the column (from the west) and the row (from the south) of a region."""
        row, col = divmod(region, self.cols)
        return col, self.rows - 1 - row

    def region(self, cell: tuple[int, int]) -> int:
        """Return the region in this column and row."""
        return (self.rows - 1 - cell[1]) * self.cols + cell[0]

    def distance(self, points: Array, cell: tuple[int, int]) -> Array:
        """Return the distance of each point (n, 2) from a cell; 0 inside it."""
        west, south = cell[0] * self.side, cell[1] * self.side
        dx = np.maximum(0.0, np.maximum(west - points[:, 0], points[:, 0] - west - self.side))
        dy = np.maximum(0.0, np.maximum(south - points[:, 1], points[:, 1] - south - self.side))
        apart: Array = np.hypot(dx, dy)
        return apart

    def cells(self, points: Array, radius: float) -> Iterator[tuple[int, int]]:
        """Yield all cells that discs of this radius around the points could touch.

        Raises UsageError for a piece of motion far off the map, with too many cells to examine."""
        low = [(each - radius) / self.side for each in points.min(axis=0).tolist()]
        high = [(each + radius) / self.side for each in points.max(axis=0).tolist()]
        if not (across := max(high[0] - low[0], high[1] - low[1])) < MOST_CELLS:
            found = f"a piece of the motion spans {across:.6g} regions"
            raise UsageError(f"{found}; expected fewer than {MOST_CELLS}")
        cols, rows = (range(floor(low[i]), floor(high[i]) + 1) for i in (0, 1))
        return product(cols, rows)


class Examination:
    """A motion, its trace, and the ``findings`` so far. ``pieces``: each robot's pieces in the
    order of the file; ``numbers``: each robot's numerical parameters in the header; ``held``: the
    reservations."""

    def __init__(self, motion: file.Motion, trace: Trace) -> None:
        header = motion.header
        self.motion, self.trace, self.obstacles = motion, trace, trace.obstacles
        self.findings: list[Finding] = []
        self.pieces = {name: motion.of(file.Moving, name) for name in header.robots}
        self.actions = motion.of(file.Action)
        self.numbers = {
            name: {key: float(v) for key, v in own.items() if isinstance(v, int | float)}
            for name, own in header.robots.items()
        }
        self.makespan = motion.outcome.makespan
        self.grid = Grid(header.rows, header.cols, header.side)
        self._shapes: dict[tuple[str, Hashable], Walked] = {}

    def wrong(self, t: float, robot: str, rule: str, found: str) -> None:
        """Report that a rule is broken."""
        self.findings.append(Finding(t, robot, rule, found))

    def limit(
        self, robot: str, times: Array, found: Array, most: float, rule: str, words: str
    ) -> None:
        """Report a broken rule if the maximum of the ``found`` values, one for each time, exceeds
        ``most``. ``words``: message with places for both."""
        worst = int(found.argmax())
        if found[worst] > most:
            self.wrong(float(times[worst]), robot, rule, words.format(found[worst], most))

    def in_conflict(self, one: str, other: str) -> bool:
        robots = self.trace.robots
        return one != other and robots[one].conflicts(robots[other])

    def radius(self, robot: str) -> float:
        """Return the radius in metres of a disc that contains the robot's body."""
        return self.numbers[robot]["size"] / 2

    @cached_method
    def walked(self, segment: file.Segment) -> Walked:
        """Return the samples of a segment. Segments of the same shape share them."""
        key = segment.robot, shape_of(segment)
        if key not in self._shapes:
            self._shapes[key] = walked(segment, self.numbers[segment.robot])
        return self._shapes[key]

    @cached_method
    def flown(self, piece: file.Flight) -> list[tuple[Array, Array]]:
        """Return the times and path of each part of a flight. A resting body needs two samples."""
        found, begin = [], piece.t0
        for part in piece.parts:
            degree = max(len(axis) for axis in (part.x, part.y, part.z, part.yaw)) - 1
            # Close enough to keep the curve near its samples.
            step = min(STEP, part.seconds / (2 * (degree + 1) ** 2)) if degree else inf
            times = grid(part.seconds, step or STEP)
            found.append((begin + times, path(part, times)))
            begin += part.seconds
        return found

    @cached_method
    def discs(self, piece: file.Moving) -> list[Disc]:
        """Return the moving discs of a piece of motion: first the body, then a walker's feet, on
        the ground and in the air."""
        return [*self._made(piece)]

    def _made(self, piece: file.Moving) -> Iterator[Disc]:
        radius, own = self.radius(piece.robot), self.numbers[piece.robot]
        if isinstance(piece, file.Flight):
            parts = self.flown(piece)
            times = np.concatenate([times for times, _ in parts])
            yield Disc("body", radius, times, np.concatenate([at[0, :2].T for _, at in parts]))
        elif isinstance(piece, file.Segment):
            moved, begin = self.walked(piece), piece.t0
            middle = moved.moved(piece, moved.mass.states[:, :2])
            yield Disc("body", radius, begin + moved.mass.times, middle)
            foot = hypot(own["sole_length"], own["sole_width"]) / 2
            if piece.feet:
                ends = [(t, hold.x, hold.y) for hold in piece.feet for t in (hold.down, hold.up)]
                feet = np.array(ends)
                yield Disc("foot", foot, begin + feet[:, 0], feet[:, 1:])
            if piece.swings:
                places = moved.moved(piece, moved.places.reshape(-1, 2))
                yield Disc("swinging foot", foot, begin + moved.times.ravel(), places)

    def body(self, robot: str, begin: float, end: float) -> Array:
        """Return the sampled centres (n, 2) of a robot's body between two times."""
        found = [np.empty((0, 2))]
        for piece in self.pieces[robot]:
            if piece.t0 < end - NEAR and piece.t1 > begin + NEAR:
                body = self.discs(piece)[0]
                inside = (body.times >= begin - NEAR) & (body.times <= end + NEAR)
                found.append(body.centres[inside])
        return np.concatenate(found)

    def places(self, robot: str, times: Array) -> Array:
        """Return the centre of a robot's body at given times: (times, 2)."""
        bodies = [self.discs(piece)[0] for piece in self.pieces[robot]]
        samples = np.concatenate([body.times for body in bodies])
        centres = np.concatenate([body.centres for body in bodies])
        order = np.argsort(samples, kind="stable")
        columns = [np.interp(times, samples[order], centres[order, axis]) for axis in (0, 1)]
        return np.stack(columns, axis=1)


TOUCH = 1e-6
"""Tolerance for rounding at the border of a body's regions, in metres."""
INSTANT = 0.05
"""Seconds between the instants at which distances are measured."""


def outside(case: Examination, disc: Disc, spans: Sequence[Holding]) -> tuple[float, str] | None:
    """Return a time at which a disc is in a region without a reservation of its robot (``spans``),
    and a description of the place; None if there is none."""
    held: dict[tuple[int, int], list[Holding]] = {}
    for span in spans:
        held.setdefault(case.grid.place(span.region), []).append(span)
    begin, end = disc.times.min() + NEAR, disc.times.max() - NEAR
    for cell in case.grid.cells(disc.centres, disc.radius):
        mine = held.get(cell, [])
        if any(span.begin <= begin and end <= span.end for span in mine):
            continue
        into = disc.radius - case.grid.distance(disc.centres, cell)
        for span in mine:
            into[(disc.times >= span.begin - NEAR) & (disc.times <= span.end + NEAR)] = -1.0
        worst = int(into.argmax())
        if into[worst] > TOUCH:
            (x, y), region = disc.centres[worst], case.grid.region(cell)
            what = f"its {disc.what} at ({x:.3f}, {y:.3f}) m reaches {into[worst]:.3f} m into "
            return float(disc.times[worst]), f"{what}region {region}, which it must not enter then"
    return None


def check_room(case: Examination) -> None:
    """Check that bodies and feet stay inside the regions of their step."""
    for name, pieces in case.pieces.items():
        for piece in pieces:
            ends = {piece.origin, piece.to}
            spans = [Holding(name, region, piece.t0, piece.t1) for region in ends]
            for disc in case.discs(piece):
                if (found := outside(case, disc, spans)) is not None:
                    case.wrong(found[0], name, "room", found[1])


def check_distances(case: Examination) -> None:
    """Check that bodies of robots in conflict never touch."""
    times: Array = np.arange(0.0, case.makespan, INSTANT)
    moved = [name for name, pieces in case.pieces.items() if pieces]
    where = {name: case.places(name, times) for name in moved} if len(times) else {}
    for one, other in combinations(where, 2):
        apart = np.hypot(*(where[one] - where[other]).T)
        nearest, least = int(apart.argmin()), case.radius(one) + case.radius(other)
        if apart[nearest] < least - TOUCH and case.in_conflict(one, other):
            what = f"its body is {apart[nearest]:.3f} m from that of {one}"
            what += f", and must be at least {least:.3f} m"
            case.wrong(float(times[nearest]), other, "distance", what)


MASS, GRAVITY, DRAG = 0.5, 9.81, 0.25
PULL = 0.2
"""Tolerance (m/s^2) of the mean acceleration between two samples, since attitude changes."""
LONGEST = 0.05
"""Maximum time between two samples, in seconds."""
WAY = 0.005
"""Tolerance (m) of the path between two samples, computed from their mean speed."""
OFF = 0.05
"""Maximum distance of a simulated flight from its reference, in metres."""


def check_tracks(case: Examination) -> None:
    """Check that a simulated flight lasts to the end of the motion. Only thrust, gravity and air
    must move the rigid body, near its reference and inside the regions of its steps."""
    for track in case.motion.of(file.FlownTrack):
        rows: Array = np.array(track.rows)
        times: Array = track.t0 + track.step * np.arange(len(rows), dtype=np.float64)
        whole = abs(track.t0) < NEAR and times[-1] > case.makespan - track.step - NEAR
        if not (whole and 0 < track.step <= LONGEST + NEAR):
            what = f"a simulated flight must have a row every {LONGEST:g} s, to the end"
            case.wrong(0.0, track.robot, "track", what)
        else:
            _flown(case, track, rows, times)


def _flown(case: Examination, track: file.FlownTrack, rows: Array, times: Array) -> None:
    limited = partial(case.limit, track.robot, times)
    velocity, axis = rows[:, 3:6], _up(rows)
    spin = np.abs(np.hypot.reduce(rows[:, 6:10], axis=1) - 1)
    limited(spin, 1e-4, "attitude", "a quaternion whose length is not 1")
    moved = np.diff(rows[:, :3], axis=0) - (velocity[1:] + velocity[:-1]) / 2 * track.step
    missed = np.abs(moved).max(axis=1, initial=0.0)
    limited(missed, WAY, "dynamics", "it moves {:.3f} m away from where its velocity leads")
    pull = axis * rows[:, 13:14] / MASS - DRAG * velocity - (0.0, 0.0, GRAVITY)
    change = np.diff(velocity, axis=0) / track.step - (pull[1:] + pull[:-1]) / 2
    missed = np.abs(change).max(axis=1, initial=0.0)
    words = "its acceleration differs by {:.2f} m/s^2 from that of its thrust"
    limited(missed, PULL, "dynamics", words)
    steepest = 1.3 * np.arctan(np.sqrt(2) * case.numbers[track.robot]["tilt"] / GRAVITY)
    lean = np.degrees(np.arccos(np.clip(axis[:, 2], -1, 1)))
    limited(lean, float(np.degrees(steepest)), "tilt", "it leans by {:.0f} degrees")
    flights = case.motion.of(file.Flight, track.robot)
    planned = sampled(flights, times, {})
    off = np.hypot.reduce([rows[:, k] - planned[axis] for k, axis in enumerate("xyz")])
    limited(off, OFF, "track", "it is {:.3f} m off its reference")
    spans = [
        Holding(track.robot, region, flight.t0, flight.t1)
        for flight in flights
        for region in {flight.origin, flight.to}
    ]
    body = Disc("body", case.radius(track.robot), times, rows[:, :2])
    if (found := outside(case, body, spans)) is not None:
        case.wrong(found[0], track.robot, "room", f"in its simulated flight, {found[1]}")


def _up(rows: Array) -> Array:
    """Return the direction (n, 3) of the thrust in each row of a simulated flight."""
    w, x, y, z = rows[:, 6:10].T
    axis: Array = np.stack(
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x**2 + y**2)], axis=1
    )
    return axis
