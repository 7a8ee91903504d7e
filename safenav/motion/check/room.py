"""The rules of room: reservations of regions, bodies inside reserved regions, and distances.

A flyer in wind is a rigid body that moves by thrust, gravity and air alone, inside the regions that
it has reserved.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations

import numpy as np

from safenav.motion.check.examination import NEAR, Array, Disc, Examination, Holding
from safenav.motion.columns import sampled
from safenav.motion.file import TRACK_COLUMNS, Flight, FlownTrack, Release, Reserve

FOREVER = float("inf")
TOUCH = 1e-6
"""Metres that a body may reach over the border of its room by rounding."""
MEASURED_TOUCH = 0.01
"""The same for positions by odometry."""
STEP = 0.05
"""Seconds between the instants at which distances are measured."""


def holdings(case: Examination) -> list[Holding]:
    """Return the times for which each robot has reserved each region."""
    found: list[Holding] = []
    open_since: dict[tuple[str, int], float] = {}
    for line in case.motion.lines:
        if isinstance(line, Reserve):
            open_since.setdefault((line.robot, line.region), line.t)
        elif isinstance(line, Release) and (line.robot, line.region) in open_since:
            begin = open_since.pop((line.robot, line.region))
            found.append(Holding(line.robot, line.region, begin, line.t))
    found += [Holding(who, region, t, FOREVER) for (who, region), t in open_since.items()]
    return sorted(found, key=lambda held: (held.begin, held.robot))


def outside(
    case: Examination, disc: Disc, spans: Sequence[Holding], touch: float
) -> tuple[float, str] | None:
    """Return where a disc is more than ``touch`` metres inside a region that its robot does not
    have at the time, by ``spans``: the time, and the place in words."""
    first, last = disc.times.min(), disc.times.max()
    for cell in case.grid.cells(disc.centres, disc.radius):
        mine = [span for span in spans if case.grid.place(span.region) == cell]
        if any(span.begin < first + NEAR and last < span.end + NEAR for span in mine):
            continue
        into = disc.radius - case.grid.distance(disc.centres, cell)
        for span in mine:
            into[(disc.times >= span.begin - NEAR) & (disc.times <= span.end + NEAR)] = -1.0
        worst = int(into.argmax())
        if into[worst] > touch:
            x, y = disc.centres[worst]
            what = (
                f"its {disc.what} at ({x:.3f}, {y:.3f}) m reaches {into[worst]:.3f} m into region "
            )
            return float(
                disc.times[worst]
            ), f"{what}{case.grid.region(cell)}, which it does not have"
    return None


def check_room(case: Examination) -> None:
    """Bodies and feet stay inside the regions of their step. The plan of a driven robot leaves its
    step when that fails; it stays inside the regions that the robot has."""
    for name, pieces in case.pieces.items():
        held = [h for h in case.held if h.robot == name] if name in case.driven else []
        for piece in pieces:
            ends = {piece.origin, piece.to}
            spans = [Holding(name, region, piece.t0, piece.t1) for region in ends]
            if name in case.driven:
                spans = [h for h in held if h.begin < piece.t1 + NEAR and piece.t0 < h.end + NEAR]
            for disc in case.discs(piece):
                if (found := outside(case, disc, spans, TOUCH)) is not None:
                    case.wrong(found[0], name, "room", found[1])


def check_distances(
    case: Examination, at: Mapping[str, Callable[[Array], Array]], *, measured: bool = False
) -> None:
    """Bodies of robots in conflict never touch. ``at``: where each robot is at some times;
    ``measured``: by its odometry."""
    times: Array = np.arange(0.0, case.makespan, STEP)
    where = {name: places(times) for name, places in at.items()} if len(times) else {}
    for one, other in combinations(where, 2):
        apart = np.hypot(*(where[one] - where[other]).T)
        nearest, least = int(apart.argmin()), case.radius(one) + case.radius(other)
        touch = MEASURED_TOUCH if measured else TOUCH
        if apart[nearest] < least - touch and case.in_conflict(one, other):
            near = f"{apart[nearest]:.3f} m from"
            what = f"measured {near} {one}" if measured else f"its body is {near} that of {one}"
            rule = "measured distance" if measured else "distance"
            what += f", and must be at least {least:.3f} m"
            case.wrong(float(times[nearest]), other, rule, what)


MASS, GRAVITY, DRAG = 0.5, 9.81, 0.25
PULL = 1.5
"""Tolerance (m/s^2) of the mean acceleration between two samples: attitude and wind change within a
twentieth of a second."""
LONGEST = 0.05
"""The longest time between two samples, in seconds."""
WAY = 0.01
"""Tolerance (m) of the path between two samples, computed from their mean speed."""


def check_wind(case: Examination) -> None:
    """The flights that were simulated: every flyer's, to the end, if there is wind."""
    for name, limits in case.motion.header.robots.items():
        tracks, flights = case.motion.of(FlownTrack, name), case.motion.of(Flight, name)
        if not tracks:
            if case.motion.header.gust > 0 and limits.get("kind") == "flyer" and flights:
                case.wrong(0.0, name, "track", "no flight in the wind is recorded")
            continue
        before = len(case.findings)
        begin = 0.0
        for track in tracks:
            if abs(track.t0 - begin) > NEAR:
                what = f"no flight in the wind is recorded from {begin:.3f} s on"
                case.wrong(begin, name, "track", what)
                return
            begin = track.t0 + track.step * len(track.rows)
            _rows(case, track)
        if begin < case.makespan - tracks[-1].step:
            what = f"no flight in the wind is recorded from {begin:.3f} s on"
            case.wrong(begin, name, "track", what)
        if len(case.findings) == before:
            for track in tracks:
                _flown(case, track, flights)


def _rows(case: Examination, track: FlownTrack) -> None:
    def wrong(row: int, rule: str, found: str) -> None:
        case.wrong(track.t0 + row * track.step, track.robot, rule, found)

    if not 0 < track.step <= LONGEST + NEAR or any(len(row) != TRACK_COLUMNS for row in track.rows):
        wrong(0, "track", f"expected rows of {TRACK_COLUMNS} numbers, at most {LONGEST:g} s apart")
        return
    if len(track.rows) != len(track.errors):
        wrong(0, "track", "the numbers of rows and of errors differ")
        return
    rows = np.array(track.rows)
    spin = np.abs(np.hypot.reduce(rows[:, 6:10], axis=1) - 1)
    if spin.max() > 1e-4:
        wrong(int(spin.argmax()), "attitude", "a quaternion whose length is not 1")
        return
    moved = np.diff(rows[:, :3], axis=0) - (rows[1:, 3:6] + rows[:-1, 3:6]) / 2 * track.step
    missed = np.abs(moved).max(axis=1, initial=0.0)
    if len(missed) and missed.max() > WAY:
        what = f"it moves {missed.max():.3f} m away from where its velocity leads"
        wrong(int(missed.argmax()), "dynamics", what)
    pull = _pull(rows)
    change = np.diff(rows[:, 3:6], axis=0) / track.step - (pull[1:] + pull[:-1]) / 2
    missed = np.abs(change).max(axis=1, initial=0.0)
    if len(missed) and missed.max() > PULL:
        what = f"its velocity changes by {missed.max():.2f} m/s^2 more than its thrust explains"
        wrong(int(missed.argmax()), "dynamics", what)
    lean = np.hypot(rows[:, 7], rows[:, 8])
    most = np.sin(np.arctan(np.sqrt(2) * case.numbers[track.robot]["tilt"] / GRAVITY) / 2) * 1.3
    if lean.max() > most:
        angle = float(np.degrees(2 * np.arcsin(min(1.0, lean.max()))))
        wrong(int(lean.argmax()), "tilt", f"it leans by {angle:.0f} degrees")


def _flown(case: Examination, track: FlownTrack, flights: Sequence[Flight]) -> None:
    """The body of one flyer in wind stays inside its regions, and its errors are those that the
    file records."""
    rows: Array = np.array(track.rows, dtype=np.float64)
    times: Array = track.t0 + track.step * np.arange(len(rows), dtype=np.float64)
    spans = [
        Holding(track.robot, region, flight.t0, flight.t1)
        for flight in flights
        for region in {flight.origin, flight.to}
    ]
    body = Disc("body", case.radius(track.robot), times, rows[:, :2])
    if (found := outside(case, body, spans, TOUCH)) is not None:
        case.wrong(found[0], track.robot, "room", f"in the wind, {found[1]}")
    reference = sampled(flights, times, {})
    off = np.hypot(rows[:, 0] - reference["x"], rows[:, 1] - reference["y"])
    apart = np.abs(off - np.array(track.errors))
    if apart.max() > 1e-3:
        what = f"it is {off[apart.argmax()]:.3f} m off its reference; the recorded error differs"
        case.wrong(float(times[apart.argmax()]), track.robot, "track", what)


def _pull(rows: Array) -> Array:
    """Acceleration (n, 3) by thrust, gravity and drag."""
    w, x, y, z = rows[:, 6:10].T
    axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x**2 + y**2)], axis=1)
    air = rows[:, 3:6] - np.stack([rows[:, 14], rows[:, 15], np.zeros(len(rows))], axis=1)
    pull: Array = axis * rows[:, 13:14] / MASS - DRAG * air
    pull[:, 2] -= GRAVITY
    return pull
