"""The rules of room: reservations of regions, bodies inside reserved regions, and distances."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import combinations

import numpy as np

from safenav.motion.check.examination import NEAR, Examination, Holding
from safenav.motion.check.paths import Array, Disc
from safenav.motion.file.records import Moving, Release, Reserve

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
            if (line.robot, line.region) in open_since:
                what = f"it reserves region {line.region} twice"
                case.wrong(line.t, line.robot, "reservation", what)
            open_since.setdefault((line.robot, line.region), line.t)
        elif isinstance(line, Release):
            begin = open_since.pop((line.robot, line.region), None)
            if begin is None:
                what = f"it releases region {line.region}, which it has not reserved"
                case.wrong(line.t, line.robot, "reservation", what)
            else:
                found.append(Holding(line.robot, line.region, begin, line.t))
    found += [Holding(who, region, t, FOREVER) for (who, region), t in open_since.items()]
    return sorted(found, key=lambda held: (held.begin, held.robot))


def check_overlaps(case: Examination) -> None:
    """Robots in conflict never occupy one region at the same time."""
    regions: dict[int, list[Holding]] = {}
    for holding in case.held:
        regions.setdefault(holding.region, []).append(holding)
    for region, holders in regions.items():
        for one, other in combinations(holders, 2):
            shared = min(one.end, other.end) - max(one.begin, other.begin)
            if shared > NEAR and case.in_conflict(one.robot, other.robot):
                seconds = "forever" if shared == FOREVER else f"for {shared:.3f} s"
                what = f"it and {one.robot} both reserve region {region} {seconds}"
                case.wrong(max(one.begin, other.begin), other.robot, "overlap", what)


def check_never_together(case: Examination) -> None:
    """At most one robot of an exclusion has reserved any of its regions."""
    for zone in case.trace.header.scenario.never_together or ():
        inside = [h for h in case.held if h.robot in zone.robots and h.region in zone.regions]
        for one, other in combinations(inside, 2):
            shared = min(one.end, other.end) - max(one.begin, other.begin)
            if one.robot != other.robot and shared > NEAR:
                what = f"it reserves region {other.region} while {one.robot} reserves {one.region}"
                what += ", which 'never_together' forbids"
                case.wrong(max(one.begin, other.begin), other.robot, "never-together", what)


def outside(
    case: Examination, robot: str, times: Array, places: Array, spans: list[Holding], touch: float
) -> tuple[float, str] | None:
    """Return where the disc of a robot is more than ``touch`` metres inside a region that it has
    not reserved at the time: the time, and the place in words. ``spans``: its reservations."""
    for cell in case.grid.cells(places, case.radius(robot)):
        into = case.radius(robot) - case.grid.distance(places, cell)
        for span in spans:
            if case.grid.place(span.region) == cell:
                into[(times >= span.begin - NEAR) & (times <= span.end + NEAR)] = -1.0
        worst = int(into.argmax())
        if into[worst] > touch:
            x, y = places[worst]
            what = f"({x:.3f}, {y:.3f}) m, {into[worst]:.3f} m into region "
            return float(times[worst]), f"{what}{case.grid.region(cell)}, which it has not reserved"
    return None


def check_room(case: Examination) -> None:
    """Bodies and feet stay inside the regions of their step that their robot has reserved at the
    time: a reservation alone does not let a robot enter, since an obstacle may be there. The
    plan of a driven robot leaves its step when that fails; the trace has its reservations."""
    to_come: dict[str, list[Holding]] = {}
    for holding in sorted(case.held, key=lambda h: -h.begin):
        to_come.setdefault(holding.robot, []).append(holding)
    having: dict[str, list[Holding]] = {}
    for piece in sorted(case.motion.of(Moving), key=lambda piece: piece.t0):
        later = to_come.get(piece.robot, [])
        now = [h for h in having.get(piece.robot, []) if h.end >= piece.t0 - NEAR]
        while later and later[-1].begin <= piece.t0 + NEAR:
            now.append(later.pop())
        having[piece.robot] = now
        entered = [h.region for h in now if h.end >= piece.t1 - NEAR]
        if piece.robot not in case.driven:
            entered = [region for region in entered if region in (piece.origin, piece.to)]
        own = {case.grid.place(region) for region in entered}
        for disc in case.discs(piece):
            _contained(case, piece, disc, own)


def _contained(case: Examination, piece: Moving, disc: Disc, own: set[tuple[int, int]]) -> None:
    for cell in case.grid.cells(disc.centres, disc.radius):
        if cell in own:
            continue
        into = disc.radius - case.grid.distance(disc.centres, cell)
        if disc.radius == 0:
            into = np.where(into < 0, into, 1.0)
        worst = int(into.argmax())
        if into[worst] > TOUCH:
            x, y = disc.centres[worst]
            what = (
                f"its {disc.what} at ({x:.3f}, {y:.3f}) m reaches {into[worst]:.3f} m into "
                f"region {case.grid.region(cell)}, which it has not reserved"
            )
            case.wrong(float(disc.times[worst]), piece.robot, "room", what)
            return


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
