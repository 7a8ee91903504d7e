"""The map of a scenario: which regions are free, which lie next to each other, who sees whom.

Independent of ``safenav.world`` on purpose: a mistake there must not hide here. Regions count from
0 in reading order from the north-west: ``region = row * cols + col``."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache
from itertools import chain, product
from typing import Any

from safenav.audit.language import HEADINGS, Pose, closure, require
from safenav.audit.poses import PoseGraph


class World:
    """The map of a trace. ``names``: of single regions, ``areas``: of several. ``live``: robots may
    make any number of steps between two looks. Regions off the map are accepted as arguments; they
    are not free."""

    def __init__(
        self,
        grid: Sequence[str],
        rows: int,
        cols: int,
        names: Mapping[str, int] | None = None,
        areas: Mapping[str, Collection[int]] | None = None,
        *,
        live: bool = False,
    ) -> None:
        self.rows, self.cols, self.size, self.live = rows, cols, rows * cols, live
        self.free = frozenset(
            row * cols + col
            for row, line in enumerate(grid[:rows])
            for col, cell in enumerate(line[:cols])
            if cell != "#"
        )
        self.names = {frozenset([region]): name for name, region in (names or {}).items()}
        self.names |= {frozenset(regions): name for name, regions in (areas or {}).items()}
        many = {"north": rows, "south": rows, "east": cols, "west": cols}
        self.sides = [heading for heading in HEADINGS if many[heading] > 1]
        self._beside, self._steps = cache(self._regions_beside), cache(self._steps_of)
        self._graphs = cache(self._graph_of)
        self.connected = cache(self._connected)

    @classmethod
    def of(cls, data: Mapping[str, Any], *, live: bool = False) -> World:
        """The map that a file has. Raises RefusedError if its cells or names are odd."""
        cells, named, areas = "".join(data["grid"]), data.get("names"), data.get("areas")
        good = {*map(len, data["grid"])} == {data["cols"]} and len(data["grid"]) == data["rows"]
        good = good and {*cells} <= {*"#."}
        require(good, "the map has rows of different lengths, or cells other than # and .")
        good = all(re.fullmatch(r"[\w-]+", name) for name in (*(named or ()), *(areas or ())))
        require(good, "a name of a region has characters other than letters, digits, _ and -")
        return cls(data["grid"], data["rows"], data["cols"], named, areas, live=live)

    def on_map(self, region: int) -> bool:
        return 0 <= region < self.size

    def is_free(self, region: int) -> bool:
        """Return whether the region is on the map and not a wall."""
        return region in self.free

    def show(self, region: int) -> str:
        """``47 (3, 8)``: region numbers as shown to people."""
        if not self.on_map(region):
            return f"{region} (off the map)"
        row, col = divmod(region, self.cols)
        return f"{region} ({row}, {col})"

    def direction(self, origin: int, to: int) -> str | None:
        """Return the heading of a single step between two regions, or None if they are not
        4-neighbours (the east end of a row is not a neighbour of the next row's west end)."""
        if origin == to or not self.on_map(origin):
            return None
        beside = self._beside(origin).items()
        return next((heading for heading, there in beside if there == to), None)

    def neighbours(self, region: int) -> list[int]:
        """Return the free regions that one step leads to."""
        steps = (self.step(region, heading) for heading in HEADINGS)
        return [to for to in steps if to is not None]

    def word(self, regions: Collection[int]) -> str:
        """Return the name of an area or a region, or its numbers."""
        each = (self.names.get(frozenset([r]), str(r)) for r in sorted(regions))
        return self.names.get(frozenset(regions)) or " or ".join(each)

    def step(self, region: int, heading: str) -> int | None:
        """Return the free region on that side, or None."""
        beyond = self._beside(region)[heading]
        return beyond if beyond in self.free else None

    def _regions_beside(self, region: int) -> dict[str, int | None]:
        """The region on each side, None off the map."""
        row, col = divmod(region, self.cols)
        there = {"north": row > 0, "east": col < self.cols - 1}
        there |= {"south": row < self.rows - 1, "west": col > 0}
        steps = dict(zip(HEADINGS, (-self.cols, 1, self.cols, -1), strict=True))
        return {h: region + step if there[h] else None for h, step in steps.items()}

    def around(self, regions: Iterable[int]) -> set[int]:
        """Return the regions and their free neighbours."""
        return {*chain(*((region, *self.neighbours(region)) for region in regions))}

    def _connected(self, region: int, closed: frozenset[int]) -> frozenset[int]:
        """Return the regions to which a path leads outside ``closed`` ones, and the region."""

        def beside(region: int) -> Iterator[int]:
            return (to for to in self.neighbours(region) if to not in closed)

        return frozenset(closure([region], beside))

    def later(self, regions: Iterable[int]) -> set[int]:
        """Return where a robot in one of the regions may be at the next look: at most one step
        away; in a live run, where nothing bounds the number of its steps, wherever it can go."""
        before, after = {*regions}, self.around(regions)
        while self.live and after != before:
            before, after = after, before | self.around(after - before)
        return after

    def moves(self, mobility: str, pose: Pose) -> set[Pose]:
        """Return the poses after one step or none. With heading mobility a robot never goes
        backwards, faces the direction of its step, and keeps its heading while it stays."""
        return {pose, *self.steps(mobility, pose)}

    def steps(self, mobility: str, pose: Pose) -> tuple[Pose, ...]:
        """Return the poses after one step."""
        return self._steps(mobility == "free", pose)

    def graph(self, mobility: str) -> PoseGraph:
        """Return the steps from each pose in a free region (cached)."""
        return self._graphs(mobility == "free")

    def _graph_of(self, free: bool) -> PoseGraph:
        poses = product(self.free, (None,) if free else HEADINGS)
        return PoseGraph((pose, self._steps(free, pose)) for pose in poses)

    def _steps_of(self, free: bool, pose: Pose) -> tuple[Pose, ...]:
        back = None if free or pose[1] is None else opposite(pose[1])
        steps = ((self.step(pose[0], h), None if free else h) for h in HEADINGS if h != back)
        return tuple((region, heading) for region, heading in steps if region is not None)

    def sees(self, a: int, b: int, radius: float | None, closed: Collection[int]) -> bool:
        """Return whether region b is in sight from a. The distance of the centres is at most the
        radius; the segment between them passes through the interior of no wall or closed region,
        and not between two of them that touch at a corner."""
        (row, col), (row_b, col_b) = divmod(a, self.cols), divmod(b, self.cols)
        down, right = row_b - row, col_b - col
        if radius is not None and down * down + right * right > radius * radius:
            return False
        shut: dict[tuple[int, int], int] = {}  # distance of the segment from closed regions
        for r, c in product(*(range(min(0, far), max(0, far) + 1) for far in (down, right))):
            region = (row + r) * self.cols + col + c
            if region not in self.free or (region in closed and region not in (a, b)):
                shut[r, c] = 2 * abs(down * c - right * r) - abs(down) - abs(right)
        across = (1 if down > 0 else -1, 1 if right > 0 else -1)
        corners = ((r, c) for r, c in shut if shut.get((r + across[0], c - across[1])) == 0)
        return min(shut.values(), default=0) >= 0 and all(shut[corner] > 0 for corner in corners)


def opposite(heading: str) -> str:
    """Return the opposite heading."""
    return HEADINGS[HEADINGS.index(heading) - 2]
