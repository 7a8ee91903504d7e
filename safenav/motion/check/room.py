"""The rules of room: who has which region when, and bodies inside what they have."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from itertools import combinations
from math import ceil, floor

import numpy as np
from msgspec import Struct

from safenav.motion.check.finding import NEAR, Finding, Report
from safenav.motion.check.paths import Array, Disc, discs
from safenav.motion.file.records import MotionHeader, Moving, Release, Reserve

FOREVER = float("inf")
TOUCH = 1e-6
"""Metres that a body may reach over the border of its room by rounding."""


class Holding(Struct, frozen=True):
    """A robot has a region from ``begin`` to ``end``."""

    robot: str
    region: int
    begin: float
    end: float


def holdings(lines: Iterable[object], report: Report) -> list[Holding]:
    """Who has which region when."""
    found: list[Holding] = []
    open_since: dict[tuple[str, int], float] = {}
    for line in lines:
        if isinstance(line, Reserve):
            if (line.robot, line.region) in open_since:
                what = f"it reserves region {line.region} twice"
                report(Finding(line.t, line.robot, "reservation", what))
            open_since.setdefault((line.robot, line.region), line.t)
        elif isinstance(line, Release):
            begin = open_since.pop((line.robot, line.region), None)
            if begin is None:
                what = f"it releases region {line.region}, which it does not have"
                report(Finding(line.t, line.robot, "reservation", what))
            else:
                found.append(Holding(line.robot, line.region, begin, line.t))
    found += [Holding(who, region, t, FOREVER) for (who, region), t in open_since.items()]
    return sorted(found, key=lambda held: (held.begin, held.robot))


def check_overlaps(
    held: Iterable[Holding], conflicts: Mapping[str, frozenset[str]], report: Report
) -> None:
    """Robots in conflict never occupy one region at the same time."""
    regions: dict[int, list[Holding]] = {}
    for holding in held:
        regions.setdefault(holding.region, []).append(holding)
    for region, holders in regions.items():
        for one, other in combinations(holders, 2):
            if other.robot not in conflicts[one.robot] and one.robot not in conflicts[other.robot]:
                continue
            shared = min(one.end, other.end) - max(one.begin, other.begin)
            if shared > NEAR:
                seconds = "forever" if shared == FOREVER else f"for {shared:.3f} s"
                what = f"it has region {region} together with {one.robot} {seconds}"
                report(Finding(max(one.begin, other.begin), other.robot, "overlap", what))


class Grid(Struct, frozen=True):
    """The map as the checker sees it."""

    rows: int
    cols: int
    side: float

    def place(self, region: int) -> tuple[int, int]:
        """Column from the west, row from the south."""
        row, col = divmod(region, self.cols)
        return col, self.rows - 1 - row

    def distance(self, points: Array, cell: tuple[int, int]) -> Array:
        """From each point (n, 2) to a cell; 0 inside it."""
        west, south = cell[0] * self.side, cell[1] * self.side
        dx = np.maximum(0.0, np.maximum(west - points[:, 0], points[:, 0] - west - self.side))
        dy = np.maximum(0.0, np.maximum(south - points[:, 1], points[:, 1] - south - self.side))
        apart: Array = np.hypot(dx, dy)
        return apart

    def cells(self, points: Array, radius: float) -> Iterable[tuple[int, int]]:
        """All cells that discs of this radius around the points could touch."""
        low = (points.min(axis=0) - radius) / self.side
        high = (points.max(axis=0) + radius) / self.side
        for col in range(floor(low[0]), ceil(high[0]) + 1):
            for row in range(floor(low[1]), ceil(high[1]) + 1):
                yield col, row


def outside(
    times: Array,
    places: Array,
    radius: float,
    own: Iterable[Holding],
    grid: Grid,
    touch: float = TOUCH,
) -> tuple[float, float, float, float, int] | None:
    """Where a disc reaches into a region that it does not have at the time: the time, x, y, by how
    many metres at most, and the region; None if it stays in its own."""
    spans = list(own)
    for cell in grid.cells(places, radius):
        into = radius - grid.distance(places, cell)
        free = np.zeros(len(times), dtype=bool)
        for span in spans:
            if grid.place(span.region) == cell:
                free |= (times >= span.begin - NEAR) & (times <= span.end + NEAR)
        into = np.where(free, -1.0, into)
        worst = int(into.argmax())
        if into[worst] > touch:
            region = (grid.rows - 1 - cell[1]) * grid.cols + cell[0]
            x, y = (float(value) for value in places[worst])
            return float(times[worst]), x, y, float(into[worst]), region
    return None


def check_room(
    pieces: Iterable[Moving],
    held: Iterable[Holding],
    header: MotionHeader,
    limits: Mapping[str, Mapping[str, object]],
    report: Report,
) -> None:
    """Bodies and feet stay inside the regions that their robot has at the time."""
    grid = Grid(header.rows, header.cols, header.side)
    to_come: dict[str, list[Holding]] = {}
    for holding in sorted(held, key=lambda h: -h.begin):
        to_come.setdefault(holding.robot, []).append(holding)
    having: dict[str, list[Holding]] = {}
    for piece in sorted(pieces, key=lambda piece: piece.t0):
        later = to_come.get(piece.robot, [])
        now = [h for h in having.get(piece.robot, []) if h.end >= piece.t0 - NEAR]
        while later and later[-1].begin <= piece.t0 + NEAR:
            now.append(later.pop())
        having[piece.robot] = now
        own = {grid.place(h.region) for h in now if h.end >= piece.t1 - NEAR}
        for disc in discs(piece, limits[piece.robot]):
            _contained(piece, disc, own, grid, report)


def _contained(
    piece: Moving, disc: Disc, own: set[tuple[int, int]], grid: Grid, report: Report
) -> None:
    for cell in grid.cells(disc.centres, disc.radius):
        if cell in own:
            continue
        into = disc.radius - grid.distance(disc.centres, cell)
        if disc.radius == 0:
            into = np.where(into < 0, into, 1.0)
        worst = int(into.argmax())
        if into[worst] > TOUCH:
            col, row = cell
            region = (grid.rows - 1 - row) * grid.cols + col
            x, y = disc.centres[worst]
            what = (
                f"its {disc.what} at ({x:.3f}, {y:.3f}) m reaches {into[worst]:.3f} m into "
                f"region {region}, which it does not have"
            )
            report(Finding(float(disc.times[worst]), piece.robot, "room", what))
            return
