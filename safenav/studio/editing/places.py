"""Regions as they stand in the text of a scenario: found, read and written, all in one place."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from safenav.errors import UsageError
from safenav.scenario.objective import kinds_that

OBJECTIVES = kinds_that()
LISTS = kinds_that(lambda kind: not kind.one)


class MapPlaces:
    """The regions of one document: ``rows`` x ``cols`` of its grid."""

    def __init__(self, data: Any) -> None:
        self.data = data
        self.grid = grid_of(data)
        self.rows, self.cols = len(self.grid), len(self.grid[0])

    @property
    def names(self) -> dict[str, Any]:
        """The names that the map gives regions."""
        names = self.data["map"].get("names")
        return names if isinstance(names, dict) else {}

    def read(self, value: Any) -> int | None:
        """The region that stands there, None if it is none of the map."""
        if isinstance(value, str) and value in self.names:
            value = self.names[value]
        if isinstance(value, int) and not isinstance(value, bool):
            return int(value)
        if isinstance(value, list) and len(value) == 2 and all(isinstance(v, int) for v in value):
            return int(value[0]) * self.cols + int(value[1])
        return None

    def written(self, region: int, like: Any = None) -> Any:
        """A region, in the way in which ``like`` is written: by a name if it has one."""
        if not 0 <= region < self.rows * self.cols:
            raise UsageError(f"{region} is not a region of the map")
        if isinstance(like, str) or like is None:
            for name, value in self.names.items():
                if self.read(value) == region:
                    return name
        if isinstance(like, int):
            return region
        pair = CommentedSeq([region // self.cols, region % self.cols])
        pair.fa.set_flow_style()
        return pair

    def each(self) -> Iterator[tuple[Any, Callable[[Any], None]]]:
        """Every value that stands for a region, with what replaces it."""
        for name in list(self.names):
            yield from self._one(self.names, name)
        areas = self.data.get("areas")
        for area in areas.values() if isinstance(areas, dict) else ():
            for index, value in enumerate(area if isinstance(area, list) else ()):
                if not isinstance(value, dict):
                    yield from self._one(area, index)
        robots = self.data.get("robots")
        for robot in robots.values() if isinstance(robots, dict) else ():
            if isinstance(robot, dict):
                yield from self._one(robot, "start")
        for objective in objectives_of(self.data):
            yield from self._objective(objective)
        for key in ("obstacles", "orders", "suspects"):
            listed = self.data.get(key)
            for obstacle in listed if isinstance(listed, list) else ():
                if isinstance(obstacle, dict):
                    yield from self._one(obstacle, "region")
                    yield from self._list(obstacle, "sweeps")
        yield from self._list(self.data, "chargers")
        partition = self.data.get("partition")
        for cell in partition if isinstance(partition, list) else ():
            if isinstance(cell, list):
                yield from self._list({"cell": cell}, "cell")
        for kind in obstacle_types(self.data):
            yield from self._list(kind, "resolve_at")
            yield from self._list(kind, "sweeps")
            needs = kind.get("needs")
            for need in needs if isinstance(needs, list) else ():
                if isinstance(need, dict):
                    yield from self._list(need, "at")
        apart = self.data.get("never_together")
        for entry in apart if isinstance(apart, list) else ():
            where = entry.get("in") if isinstance(entry, dict) else None
            if isinstance(where, list):
                for index in range(len(where)):
                    yield from self._target(where, index)
            elif where is not None:
                yield from self._target(entry, "in")

    def move_rectangles(self, down: int, aside: int) -> None:
        """Rectangles of areas after so many new rows at the top and columns at the left."""
        areas = self.data.get("areas")
        for area in areas.values() if isinstance(areas, dict) else ():
            for item in area if isinstance(area, list) else [area]:
                for key, by, most in (("rows", down, self.rows), ("columns", aside, self.cols)):
                    if isinstance(item, dict) and key in item:
                        ends = [int(end) + by for end in str(item[key]).split("-")]
                        ends = [min(max(end, 0), most - 1) for end in ends]
                        item[key] = f"{ends[0]}-{ends[-1]}" if len(ends) > 1 else ends[0]

    def _list(self, holder: Any, key: str) -> Iterator[tuple[Any, Callable[[Any], None]]]:
        """The regions of a list."""
        listed = holder.get(key)
        for index in range(len(listed) if isinstance(listed, list) else 0):
            yield from self._target(listed, index)

    def _objective(self, objective: Any) -> Iterator[tuple[Any, Callable[[Any], None]]]:
        for kind in (*OBJECTIVES, "avoid") if isinstance(objective, dict) else ():
            told = objective.get(kind)
            if kind in (*LISTS, "avoid") and isinstance(told, list):
                for index in range(len(told)):
                    yield from self._target(told, index)
            elif told is not None:
                yield from self._target(objective, kind)

    def _target(self, holder: Any, key: Any) -> Iterator[tuple[Any, Callable[[Any], None]]]:
        value = holder[key]
        if isinstance(value, dict) and isinstance(value.get("any"), list):
            for index in range(len(value["any"])):
                yield from self._one(value["any"], index)
        else:
            yield from self._one(holder, key)

    def _one(self, holder: Any, key: Any) -> Iterator[tuple[Any, Callable[[Any], None]]]:
        if isinstance(holder, dict) and key not in holder:
            return

        def replace(value: Any) -> None:
            holder[key] = value

        yield holder[key], replace


def objectives_of(data: Any) -> Iterator[Any]:
    """Yield the objectives of robots, also those for a while and those of changes."""
    robots = data.get("robots")
    for robot in robots.values() if isinstance(robots, dict) else ():
        if isinstance(robot, dict):
            when = robot.get("when")
            yield robot.get("objective")
            yield robot.get("while_waiting")
            yield from when.values() if isinstance(when, dict) else ()
    changes = data.get("changes")
    for change in changes if isinstance(changes, list) else ():
        if isinstance(change, dict):
            yield change.get("objective")


def formulas_of(data: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the formulas of objectives: where each stands, and under which key or index."""
    for objective in objectives_of(data):
        ltl = objective.get("ltl") if isinstance(objective, dict) else None
        held = [(objective, "always")] if isinstance(objective, dict) else []
        held += (
            [(ltl, key) for key in ("init", "safety", "liveness")] if isinstance(ltl, dict) else []
        )
        for holder, key in held:
            if isinstance(holder.get(key), list):
                yield from ((holder[key], index) for index in range(len(holder[key])))
            elif isinstance(holder.get(key), str):
                yield holder, key


def obstacle_types(data: Any) -> list[Any]:
    """Return the obstacle types of a catalogue in the scenario."""
    catalogue = data.get("catalogue")
    listed = catalogue.get("obstacles") if isinstance(catalogue, dict) else None
    types = listed.values() if isinstance(listed, dict) else ()
    return [kind for kind in types if isinstance(kind, dict)]


def any_of(target: Any) -> Any:
    """A target of several regions: any of them counts."""
    if not isinstance(target, list):
        return target
    regions = CommentedSeq(target)
    regions.fa.set_flow_style()
    found = CommentedMap({"any": regions})
    found.fa.set_flow_style()
    return found


def grid_of(data: Any) -> list[str]:
    """The rows of the grid. Raises UsageError where the map is not drawn in the scenario."""
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
