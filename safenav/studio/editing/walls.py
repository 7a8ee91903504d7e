"""Painting of walls in the grid of a text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ruamel.yaml.scalarstring import LiteralScalarString

from safenav.studio.editing.places import MapPlaces
from safenav.studio.editing.round_trip import Operation, inline
from safenav.world.map import Region


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


def _draw(data: Any, rows: list[str]) -> None:
    grid = data["map"]["grid"]
    if isinstance(grid, list):
        grid[:] = rows
        return
    text = LiteralScalarString("\n".join(rows) + "\n")
    if hasattr(grid, "comment"):
        text.comment = grid.comment
    data["map"]["grid"] = text


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
