"""Edits of the areas of a text: rectangles that are drawn, and their names."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ruamel.yaml.comments import CommentedMap

from safenav.errors import UsageError
from safenav.scenario.reading.naming import NAME
from safenav.studio.editing.places import MapPlaces
from safenav.studio.editing.round_trip import Operation, inline


def add_area(data: Any, told: Operation) -> None:
    """The rectangle of ``rows`` and ``columns`` (first and last) as a new ``area``, or as a further
    part of it."""
    places = MapPlaces(data)
    most = {"rows": places.rows, "columns": places.cols}
    rectangle = inline({key: _span(told[key], most[key]) for key in most})
    if not isinstance(data.get("areas"), dict):
        data.pop("areas", None)
        data.insert(list(data).index("map") + 1, "areas", CommentedMap())
        data["areas"].fa.set_block_style()
    areas, name = data["areas"], str(told["area"])
    if name not in areas:
        _check_name(name, places)
        areas[name] = rectangle
        return
    parts = areas[name]
    if not isinstance(parts, list):
        parts = areas[name] = inline([parts])
    parts.append(rectangle)


def rename_area(data: Any, told: Operation) -> None:
    """Another ``name``, also where the area is a target."""
    places, old, new = MapPlaces(data), told["area"], str(told.get("name"))
    area = _area(data, told)
    if new == old:
        return
    _check_name(new, places)
    for value, put in list(places.each()):
        if value == old:
            put(new)
    index = list(data["areas"]).index(old)
    del data["areas"][old]
    data["areas"].insert(index, new, area)


def remove_area(data: Any, told: Operation) -> None:
    _area(data, told)
    if any(value == told["area"] for value, _ in MapPlaces(data).each()):
        raise UsageError(f"'{told['area']}' is a target of a robot: change that first")
    del data["areas"][told["area"]]
    if not data["areas"]:
        del data["areas"]


def _area(data: Any, told: Operation) -> Any:
    areas = data.get("areas")
    if not isinstance(areas, dict) or told.get("area") not in areas:
        raise UsageError(f"no area '{str(told.get('area'))[:40]}'")
    return areas[told["area"]]


def _check_name(name: str, places: MapPlaces) -> None:
    if not NAME.fullmatch(name):
        raise UsageError("a name has letters, digits, '_' and '-', and begins with a letter")
    if name in places.names or name in (places.data.get("areas") or {}):
        raise UsageError(f"'{name}' already exists: choose another name")


def _span(ends: Sequence[int], most: int) -> int | str:
    first, last = int(ends[0]), int(ends[1])
    if not 0 <= first <= last < most:
        raise UsageError("an area lies within the map")
    return first if first == last else f"{first}-{last}"
