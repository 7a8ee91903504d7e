"""Regions, walls and moves, recomputed from the header of a trace.

Independent of ``safenav.world`` on purpose: a mistake there must not hide here. Regions count from
0 in reading order from the north-west: ``region = row * cols + col``."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection

from safenav.trace.setting import MapHeader
from safenav.trace.vocabulary import Heading, Region

_STEPS: dict[Heading, tuple[int, int]] = {
    "north": (-1, 0),
    "east": (0, 1),
    "south": (1, 0),
    "west": (0, -1),
}
_OPPOSITE = {"north": "south", "south": "north", "east": "west", "west": "east"}
_WALL = "#"


class Grid:
    """The map of a trace. Regions off the map are accepted as arguments; they are not free."""

    def __init__(self, world: MapHeader) -> None:
        self.rows = world.rows
        self.cols = world.cols
        self._grid = world.grid

    def on_map(self, region: Region) -> bool:
        return 0 <= region < self.rows * self.cols

    def is_free(self, region: Region) -> bool:
        """Return whether the region is on the map and not a wall."""
        if not self.on_map(region):
            return False
        row, col = divmod(region, self.cols)
        return row < len(self._grid) and self._grid[row][col : col + 1] not in ("", _WALL)

    def direction(self, origin: Region, to: Region) -> Heading | None:
        """Return the heading of a single step between two regions, or None if they are not
        4-neighbours (the east end of a row is not a neighbour of the next row's west end)."""
        if not (self.on_map(origin) and self.on_map(to)):
            return None
        (row, col), (to_row, to_col) = divmod(origin, self.cols), divmod(to, self.cols)
        for heading, step in _STEPS.items():
            if (to_row - row, to_col - col) == step:
                return heading
        return None

    def neighbours(self, region: Region) -> list[Region]:
        """Return the free regions that one step leads to."""
        row, col = divmod(region, self.cols)
        return [
            (row + south) * self.cols + col + east
            for south, east in _STEPS.values()
            if 0 <= col + east < self.cols and self.is_free((row + south) * self.cols + col + east)
        ]

    def show(self, region: Region) -> str:
        """``47 (3, 8)``: region numbers as shown to people."""
        if not self.on_map(region):
            return f"{region} (off the map)"
        row, col = divmod(region, self.cols)
        return f"{region} ({row}, {col})"

    def distance(
        self,
        has_heading: bool,
        origin: Region,
        heading: Heading | None,
        targets: Collection[Region],
        closed: Collection[Region],
    ) -> int | None:
        """Return the number of steps of a shortest path to the nearest target; None if there is no
        path.

        A robot with a heading neither turns on the spot nor steps backwards, so the search
        runs over pairs of region and heading. ``closed`` regions cannot be entered."""
        start = (origin, heading if has_heading else None)
        seen = {start}
        queue = deque([(start, 0)])
        while queue:
            (region, faced), steps = queue.popleft()
            if region in targets:
                return steps
            for way, (south, east) in _STEPS.items():
                if faced is not None and way == _OPPOSITE[faced]:
                    continue
                col = region % self.cols + east
                to = region + south * self.cols + east
                if not 0 <= col < self.cols or not self.is_free(to) or to in closed:
                    continue
                pose = (to, way if has_heading else None)
                if pose not in seen:
                    seen.add(pose)
                    queue.append((pose, steps + 1))
        return None


def opposite(heading: Heading) -> Heading:
    """The heading behind a robot with this one."""
    return _OPPOSITE[heading]
