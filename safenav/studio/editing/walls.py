"""Painting of walls in the grid of a text."""

from __future__ import annotations

from typing import Any

from ruamel.yaml.scalarstring import LiteralScalarString

from safenav.studio.editing.places import MapPlaces
from safenav.studio.editing.round_trip import Operation


def paint(data: Any, edit: Operation) -> None:
    """Make ``regions`` walls, or floor (``wall`` false)."""
    places = MapPlaces(data)
    rows = [list(row) for row in places.grid]
    for region in edit["regions"]:
        places.written(region, 0)
        rows[region // places.cols][region % places.cols] = "#" if edit["wall"] else "."
    _draw(data, ["".join(row) for row in rows])


def _draw(data: Any, rows: list[str]) -> None:
    grid = data["map"]["grid"]
    if isinstance(grid, list):
        grid[:] = rows
        return
    text = LiteralScalarString("\n".join(rows) + "\n")
    if hasattr(grid, "comment"):
        text.comment = grid.comment
    data["map"]["grid"] = text
