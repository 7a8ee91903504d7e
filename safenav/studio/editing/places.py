"""Search, reading and writing of regions in the data of a scenario's text."""

from __future__ import annotations

from typing import Any

from safenav.errors import UsageError
from safenav.scenario.objective import kinds_that
from safenav.scenario.reading.regions import place_of
from safenav.studio.editing.round_trip import inline

OBJECTIVES = kinds_that()
LISTS = kinds_that(lambda kind: not kind.one)


class MapPlaces:
    """The regions of one document, whose grid has ``rows`` x ``cols``."""

    def __init__(self, data: Any) -> None:
        self.data = data
        self.grid = grid_of(data)
        self.rows, self.cols = len(self.grid), len(self.grid[0])

    @property
    def names(self) -> dict[str, Any]:
        """The names of regions in the map."""
        names = self.data["map"].get("names")
        return names if isinstance(names, dict) else {}

    def read(self, value: Any) -> int | None:
        """Return the region that a value names; None if it names none."""
        place = place_of(self.names.get(value) if isinstance(value, str) else value)
        return place[0] * self.cols + place[1] if isinstance(place, tuple) else place

    def written(self, region: int, like: Any = None) -> Any:
        """Return a region in the notation of ``like``: its name if ``like`` is a text or None and
        it has one, a number, else [row, column]. Raises UsageError for one off the map."""
        if not 0 <= region < self.rows * self.cols:
            raise UsageError(f"{region} is not a region of the map")
        if isinstance(like, str) or like is None:
            for name, value in self.names.items():
                if self.read(value) == region:
                    return name
        if isinstance(like, int):
            return region
        return inline([region // self.cols, region % self.cols])


def any_of(target: Any) -> Any:
    """Return a target in the notation of scenarios: ``{any: [...]}`` for a list of regions."""
    if not isinstance(target, list):
        return target
    return inline({"any": inline(target)})


def grid_of(data: Any) -> list[str]:
    """Return the rows of the grid. Raises UsageError for a map file or an invalid grid."""
    world = data.get("map")
    grid = world.get("grid") if isinstance(world, dict) else None
    if isinstance(grid, str):
        rows = [line.rstrip() for line in grid.splitlines() if line.strip()]
    elif isinstance(grid, list):
        rows = [str(line).rstrip() for line in grid]
    else:
        raise UsageError("the map comes from a file: copy it into the scenario to edit it")
    if not rows or len({len(row) for row in rows}) != 1 or set("".join(rows)) - set("#."):
        raise UsageError("fix the grid in the text first")
    return rows
