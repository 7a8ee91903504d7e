"""Operations of the drawing on the map of a text: walls, size, areas, and names of regions."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from math import cos, sin
from typing import Any

from ruamel.yaml.comments import CommentedMap
from ruamel.yaml.scalarstring import LiteralScalarString

from safenav.errors import UsageError
from safenav.scenario.yaml.fields import NAME
from safenav.studio.editing.places import MapPlaces, formulas_of
from safenav.studio.editing.round_trip import Operation, inline, put
from safenav.world.map import Region, RegionMap


def add_area(data: Any, edit: Operation) -> None:
    """Add the rectangle of ``rows`` and ``columns`` (first and last) to ``area``, which is created
    if missing."""
    places = MapPlaces(data)
    most = {"rows": places.rows, "columns": places.cols}
    rectangle = inline({key: _span(edit[key], most[key]) for key in most})
    if not isinstance(data.get("areas"), dict):
        data.pop("areas", None)
        put(data, "areas", CommentedMap(), after="map")
        data["areas"].fa.set_block_style()
    areas, name = data["areas"], str(edit["area"])
    if name not in areas:
        _check_name(name, places)
        areas[name] = rectangle
        return
    parts = areas[name]
    if not isinstance(parts, list):
        parts = areas[name] = inline([parts])
    parts.append(rectangle)


def rename_area(data: Any, edit: Operation) -> None:
    """Rename an area to ``name``, also where it is a target."""
    places, old, new = MapPlaces(data), edit["area"], str(edit.get("name"))
    area = _area(data, edit)
    if new == old:
        return
    _check_name(new, places)
    for value, write in list(places.each()):
        if value == old:
            write(new)
    index = list(data["areas"]).index(old)
    del data["areas"][old]
    data["areas"].insert(index, new, area)


def remove_area(data: Any, edit: Operation) -> None:
    _area(data, edit)
    if any(value == edit["area"] for value, _ in MapPlaces(data).each()):
        raise UsageError(f"'{edit['area']}' is a target of a robot: change the objective first")
    del data["areas"][edit["area"]]
    if not data["areas"]:
        del data["areas"]


def _area(data: Any, edit: Operation) -> Any:
    areas = data.get("areas")
    if not isinstance(areas, dict) or edit.get("area") not in areas:
        raise UsageError(f"no area '{str(edit.get('area'))[:40]}'")
    return areas[edit["area"]]


def _check_form(name: str) -> None:
    if not NAME.fullmatch(name):
        raise UsageError("a name has letters, digits, '_' and '-', and begins with a letter")


def _check_name(name: str, places: MapPlaces) -> None:
    _check_form(name)
    if name in places.names or name in (places.data.get("areas") or {}):
        raise UsageError(f"'{name}' already exists: choose another name")


def _span(ends: Sequence[int], most: int) -> int | str:
    first, last = int(ends[0]), int(ends[1])
    if not 0 <= first <= last < most:
        raise UsageError("an area must lie within the map")
    return first if first == last else f"{first}-{last}"


MOST = 512
SIDES = ("top", "bottom", "left", "right")


def paint(data: Any, edit: Operation) -> None:
    """Make ``regions`` walls, or floor (``wall`` false)."""
    places = MapPlaces(data)
    rows = [list(row) for row in places.grid]
    for region in edit["regions"]:
        places.written(region, 0)
        rows[region // places.cols][region % places.cols] = "#" if edit["wall"] else "."
    _draw(data, ["".join(row) for row in rows])
    if not edit["wall"]:
        _join_cells(data, places, edit["regions"])


def _join_cells(data: Any, places: MapPlaces, floor: Sequence[Region]) -> None:
    """Add new floor to an adjacent cell, or a new one, if ``partition`` lists cells."""
    cells = data.get("partition")
    if not isinstance(cells, list):
        return
    owner = {places.read(value): cell for cell in cells for value in cell}
    for region in floor:
        beside = (region - places.cols, region - 1, region + 1, region + places.cols)
        cell = next((owner[r] for r in beside if r in owner), None)
        if cell is None:
            cell = inline([])
            cells.append(cell)
        if owner.setdefault(region, cell) is cell and region not in map(places.read, cell):
            cell.append(places.written(region, 0))


def resize(data: Any, edit: Operation) -> None:
    """Add (or, if negative, remove) rows and columns at each side, and renumber all regions."""
    places = MapPlaces(data)
    top, bottom, left, right = (int(edit.get(side, 0)) for side in SIDES)
    rows, cols = places.rows + top + bottom, places.cols + left + right
    if not (1 <= rows <= MOST and 1 <= cols <= MOST):
        raise UsageError(f"a map has 1 to {MOST} rows and columns")
    moved = [(value, write, places.read(value)) for value, write in places.each()]
    before = places.cols
    grid = [
        "".join(
            places.grid[row - top][col - left]
            if 0 <= row - top < places.rows and 0 <= col - left < places.cols
            else "#"
            for col in range(cols)
        )
        for row in range(rows)
    ]
    if min(rows, cols) > 2:  # open the old border where the map grows
        grid = _opened(grid, places.grid, (top, bottom, left, right))
    _draw(data, grid)
    after = MapPlaces(data)
    after.move_rectangles(top, left)

    def at(region: int) -> int:
        row = min(max(region // before + top, 0), rows - 1)
        return row * cols + min(max(region % before + left, 0), cols - 1)

    for value, write, region in moved:
        if region is not None and not isinstance(value, str):
            write(after.written(at(region), value if isinstance(value, int) else [0, 0]))
    for key in ("expect", "requirements"):
        if key in data:
            data[key] = _renamed(data[key], at)
    if top or left or cols != before:
        for holder, key in formulas_of(data):
            holder[key] = _renumbered(holder[key], at)
    if left or bottom:
        _shift_frame(data, left, bottom)


_REGION = r"(?:\bregion'?|\b(?:next|X)\(\s*region\s*\))"
_EQUAL = re.compile(rf"({_REGION}\s*!?=\s*)(\d+)\b(?!\s*\+)|\b(\d+)(?=\s*!?=\s*{_REGION})")
_ORDERED = re.compile(
    rf"{_REGION}\s*(?:<(?!-)|>|\+)|(?:(?<![-<])>|<|\+)=?\s*{_REGION}|{_REGION}\s*!?=\s*\d+\s*\+"
)


def _renumbered(formula: Any, at: Callable[[int], int]) -> Any:
    """Return a formula with the new numbers of the regions that it compares. Raises UsageError if
    it computes with numbers."""
    if not isinstance(formula, str):
        return formula
    if _ORDERED.search(formula):
        reason = f"'{formula[:60]}' computes with numbers of regions, which this would change"
        raise UsageError(f"{reason}: name the regions as an area first")

    def moved(found: re.Match[str]) -> str:
        return f"{found[1] or ''}{at(int(found[2] or found[3]))}"

    return _EQUAL.sub(moved, formula)


def _shift_frame(data: Any, left: int, bottom: int) -> None:
    """Move the origin of a map that grows in the west or the south, so that coordinates stay.
    Raises UsageError if requirements name coordinates and the map has no frame."""
    world = data["map"]
    side, origin = world.get("resolution"), world.get("origin")
    if isinstance(side, int | float) and isinstance(origin, list) and len(origin) >= 2:
        yaw = float(origin[2]) if len(origin) > 2 else 0.0
        east, north = -left * side, -bottom * side
        origin[0] = round(origin[0] + east * cos(yaw) - north * sin(yaw), 6)
        origin[1] = round(origin[1] + east * sin(yaw) + north * cos(yaw), 6)
    elif re.search(r"\b[xy]\s*\(", str(data.get("requirements", ""))):
        reason = "requirements name x or y in metres, which this would shift"
        raise UsageError(f"{reason}: give the map 'resolution' and 'origin' first")


def _renamed(item: Any, at: Callable[[int], int]) -> Any:
    """Return expectations or requirements with the new region numbers in obstacle names."""
    if isinstance(item, str):
        return re.sub(r"(?<=@)[0-9]+", lambda found: str(at(int(found[0]))), item)
    if isinstance(item, list):
        item[:] = [_renamed(one, at) for one in item]
    elif isinstance(item, CommentedMap):
        for key, value in list(item.items()):
            new = _renamed(key, at)
            if new != key:
                item.insert(list(item).index(key), new, item.pop(key))
            item[new] = _renamed(value, at)
    return item


def _opened(grid: list[str], old: list[str], grown: tuple[int, int, int, int]) -> list[str]:
    """Return the grid with floor up to the new border where the map has grown beyond an unbroken
    wall. ``grown``: rows and columns added at top, bottom, left and right."""
    top, bottom, left, right = grown
    rows, cols = len(grid), len(grid[0])
    new = [list(row) for row in grid]

    def floor(row: int, col: int) -> None:
        if 0 < row < rows - 1 and 0 < col < cols - 1:
            new[row][col] = "."

    walled = {
        "top": set(old[0]) == {"#"},
        "bottom": set(old[-1]) == {"#"},
        "left": {row[0] for row in old} == {"#"},
        "right": {row[-1] for row in old} == {"#"},
    }
    for row in range(rows):
        for col in range(cols):
            if (
                (top > 0 and walled["top"] and row <= top)
                or (bottom > 0 and walled["bottom"] and row >= rows - 1 - bottom)
                or (left > 0 and walled["left"] and col <= left)
                or (right > 0 and walled["right"] and col >= cols - 1 - right)
            ):
                floor(row, col)
    return ["".join(row) for row in new]


def name_region(data: Any, edit: Operation) -> None:
    """Give ``region`` the ``name``; an empty one removes its name."""
    places, name = MapPlaces(data), str(edit.get("name") or "")
    world = data["map"]
    used = {value for value, _ in places.each() if isinstance(value, str)}
    for old in [n for n, value in places.names.items() if places.read(value) == edit["region"]]:
        if old in used and old != name:
            raise UsageError(f"'{old}' is used in the scenario: change that first")
        del world["names"][old]
    if name:
        _check_form(name)
        if not isinstance(world.get("names"), dict):
            world["names"] = inline({})
        world["names"][name] = places.written(edit["region"], [])
    if isinstance(world.get("names"), dict) and not world["names"]:
        del world["names"]


def embed(data: Any, world: RegionMap) -> None:
    """Replace a map file by its grid in the text; areas of its legend become areas."""
    section = data["map"]
    for key in ("image", "ros", "movingai", "rows", "cols", "share", "threshold"):
        section.pop(key, None)
    section.fa.set_block_style()
    section.insert(0, "grid", LiteralScalarString("\n".join(world.grid_rows()) + "\n"))
    frame = world.frame
    if frame is not None and frame.resolution[0] == frame.resolution[1]:
        section["resolution"] = frame.resolution[0]
        section["origin"] = inline([*frame.origin, frame.yaw])
    listed = data.get("areas") or {}
    for name in sorted(world.areas.keys() - listed.keys()):
        for top, bottom, left, right in rectangles(world.areas[name], world.cols):
            add_area(data, {"area": name, "rows": (top, bottom), "columns": (left, right)})


def rectangles(area: frozenset[Region], cols: int) -> list[tuple[int, int, int, int]]:
    """Return rectangles (first and last row, first and last column) that cover an area exactly."""
    runs: dict[tuple[int, int], list[tuple[int, int]]] = {}
    rest = set(area)
    for region in sorted(area):
        if region in rest:
            row, first = divmod(region, cols)
            last = first
            while last + 1 < cols and row * cols + last + 1 in rest:
                last += 1
            rest -= set(range(region, row * cols + last + 1))
            parts = runs.setdefault((first, last), [])
            if parts and parts[-1][1] == row - 1:
                parts[-1] = (parts[-1][0], row)
            else:
                parts.append((row, row))
    return sorted((*rows, *ends) for ends, parts in runs.items() for rows in parts)


def _draw(data: Any, rows: list[str]) -> None:
    grid = data["map"]["grid"]
    if isinstance(grid, list):
        for index in range(min(len(grid), len(rows))):
            grid[index] = rows[index]
        del grid[len(rows) :]
        grid.extend(rows[len(grid) :])
    else:
        drawn = LiteralScalarString("\n".join(rows) + "\n")
        if hasattr(grid, "comment"):
            drawn.comment = grid.comment
        data["map"]["grid"] = drawn
