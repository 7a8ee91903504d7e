"""Search, reading and writing of regions in the data of a scenario's text."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from operator import setitem
from typing import Any

from safenav.errors import UsageError
from safenav.scenario.objective import kinds_that
from safenav.scenario.reading.areas import SPAN
from safenav.scenario.reading.catalogue import TypeKeys
from safenav.scenario.reading.loader import ScenarioKeys
from safenav.scenario.reading.objective import FORMULAS
from safenav.scenario.reading.regions import PLACE, REGION, place_of
from safenav.scenario.yaml.shapes import values_of
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

    def each(self) -> Iterator[tuple[Any, Callable[[Any], None]]]:
        """Yield every value that names a region, with the function that replaces it."""
        for holder, key in values_of((REGION, PLACE), ScenarioKeys, self.data):
            yield holder[key], partial(setitem, holder, key)

    def move_rectangles(self, down: int, aside: int) -> None:
        """Move the rectangles of areas by new rows at the top and columns at the left."""
        moves = {"rows": (down, self.rows), "columns": (aside, self.cols)}
        for item, key in values_of((SPAN,), ScenarioKeys, self.data):
            by, most = moves[key]
            ends = [int(end) + by for end in str(item[key]).split("-")]
            ends = [min(max(end, 0), most - 1) for end in ends]
            item[key] = f"{ends[0]}-{ends[-1]}" if len(ends) > 1 else ends[0]


def formulas_of(data: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the container, and the key or index, of each formula of objectives."""
    for holder, key in values_of((FORMULAS,), ScenarioKeys, data):
        if isinstance(holder[key], list):
            yield from ((holder[key], index) for index in range(len(holder[key])))
        elif isinstance(holder[key], str):
            yield holder, key


def obstacle_types(data: Any) -> list[Any]:
    """Return the obstacle types of a catalogue in the scenario."""
    return [holder[key] for holder, key in values_of((TypeKeys,), ScenarioKeys, data)]


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
