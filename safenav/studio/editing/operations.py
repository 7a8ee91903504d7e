"""Operations of the drawing on the text: one function per operation, each on the data of the text;
those on robots and on the map have modules of their own.

An operation is an object with ``op`` and its arguments. Regions are given by number, robots by
name, obstacles by index.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from safenav.errors import UsageError
from safenav.studio.editing.areas import add_area, remove_area, rename_area
from safenav.studio.editing.places import LISTS, MapPlaces, any_of
from safenav.studio.editing.robots import (
    add_robot,
    move_robot,
    remove_robot,
    rename_robot,
    set_form,
    set_heading,
    set_model,
    set_objective,
)
from safenav.studio.editing.round_trip import Operation, changed, parsed, put
from safenav.studio.editing.walls import name_region, paint, resize


def edited(text: str, operation: Operation) -> str:
    """The text after an operation. Raises UsageError for one that cannot be."""
    does = OPERATIONS.get(str(operation.get("op")))
    if does is None:
        raise UsageError(f"the drawing cannot '{str(operation.get('op'))[:40]}'")
    try:
        return changed(text, lambda data: does(data, operation))
    except (KeyError, TypeError, IndexError, AttributeError, ValueError) as error:
        raise UsageError(f"that cannot be drawn in this text ({type(error).__name__})") from error


def add_obstacle(data: Any, told: Operation) -> None:
    """An obstacle of ``type`` at ``region``; ``from``, ``until`` and ``traversable`` if given."""
    _add(data, "obstacles", "robots", ("type", "region", "traversable", "from", "until"), told)


def add_order(data: Any, told: Operation) -> None:
    """An order of ``type`` at ``region`` in tick ``at``."""
    _add(data, "orders", "obstacles", ("at", "type", "region"), told)


def _add(data: Any, key: str, after: str, keys: Sequence[str], told: Operation) -> None:
    """Add an entry to a list of the scenario, its region written as others are."""
    places = MapPlaces(data)
    entries = _listed(data, key, after=after)
    like = next((e["region"] for e in entries if isinstance(e, dict) and "region" in e), None)
    if like is None:
        like = next((r.get("start") for r in (data.get("robots") or {}).values()), [])
    new = CommentedMap({each: told[each] for each in keys if told.get(each) is not None})
    new["region"] = places.written(told["region"], like)
    new.fa.set_flow_style()
    entries.append(new)


def add_change(data: Any, told: Operation) -> None:
    """Add a change for ``robot`` at tick ``at``: an ``objective`` (kind and regions as numbers,
    several for a target of which any counts), or ``service``."""
    new = CommentedMap({"at": told["at"], "robot": told["robot"]})
    if told.get("objective") is not None:
        ((kind, body),) = told["objective"].items()
        targets = [any_of(target) for target in (body if kind in LISTS else [body])]
        value: Any = targets[0]
        if kind in LISTS:
            value = CommentedSeq(targets)
            value.fa.set_flow_style()
        new["objective"] = CommentedMap({kind: value})
        new["objective"].fa.set_flow_style()
    else:
        new["service"] = told["service"]
    new.fa.set_flow_style()
    _listed(data, "changes", after="obstacles" if "obstacles" in data else "robots").append(new)


def _listed(data: Any, key: str, *, after: str) -> Any:
    """The list of that name, made behind another key if there is none."""
    listed = data.get(key)
    if not isinstance(listed, list):
        if key in data:
            del data[key]
        index = list(data).index(after) + 1 if after in data else len(data)
        data.insert(index, key, CommentedSeq())
        listed = data[key]
    if len(listed) == 0:
        listed.fa.set_block_style()
    return listed


def move_obstacle(data: Any, told: Operation) -> None:
    obstacle, places = _obstacle(data, told), MapPlaces(data)
    obstacle["region"] = places.written(told["region"], obstacle.get("region"))


SETTINGS = ("traversable", "from", "until", "type", "resolve_within", "sweeps")
"""The keys of an obstacle that can be set."""


def set_obstacle(data: Any, told: Operation) -> None:
    """``key`` (one of SETTINGS) to ``value``; null takes it away."""
    obstacle = _obstacle(data, told)
    key, value = told["key"], told.get("value")
    if key not in SETTINGS:
        raise UsageError(f"an obstacle has no '{str(key)[:40]}'")
    if value is None:
        obstacle.pop(key, None)
    else:
        obstacle[key] = value


def remove_obstacle(data: Any, told: Operation) -> None:
    _obstacle(data, told)
    del data["obstacles"][told["index"]]
    if not data["obstacles"]:
        del data["obstacles"]


def set_value(data: Any, told: Operation) -> None:
    """A plain setting: ``name``, ``rounds``, ``ticks`` or ``seed``."""
    key, value = told["key"], told["value"]
    if key in ("name", "seed"):
        put(data, key, value, after="safenav" if key == "name" else "limits")
    elif key in ("rounds", "ticks"):
        holder = "until" if key == "rounds" else "limits"
        if not isinstance(data.get(holder), dict):
            data[holder] = CommentedMap()
            data[holder].fa.set_flow_style()
        data[holder][key] = int(value)
    else:
        raise UsageError(f"'{str(key)[:40]}' is not a setting of the drawing")


def repair(data: Any, told: Operation) -> None:
    """The changes of a repair (explain): items and their new values, as they would be written."""
    for item, value in told["change"]:
        walls = re.fullmatch(r"no wall at ([\d, ]+)", value)
        if item == "map" and walls is not None:
            paint(data, {"regions": [int(r) for r in walls[1].split(",")], "wall": False})
        elif item == "obstacles":
            told_obstacle = parsed(value)
            place = {"region": MapPlaces(data).read(told_obstacle["region"])}
            add_obstacle(data, {**told_obstacle, **place})
        else:
            holder = data
            *way, last = str(item).split(".")
            for key in way:
                if not isinstance(holder.get(key), dict):
                    holder[key] = CommentedMap()
                holder = holder[key]
            holder[last] = parsed(value)


def _obstacle(data: Any, told: Operation) -> Any:
    obstacles, index = data.get("obstacles"), told.get("index")
    if not isinstance(obstacles, list) or not isinstance(index, int):
        raise UsageError("there is no such obstacle")
    if not 0 <= index < len(obstacles) or not isinstance(obstacles[index], dict):
        raise UsageError("there is no such obstacle")
    return obstacles[index]


OPERATIONS: Mapping[str, Callable[[Any, Operation], None]] = {
    found.__name__: found
    for found in (
        paint,
        resize,
        add_robot,
        move_robot,
        set_heading,
        set_model,
        set_objective,
        set_form,
        rename_robot,
        remove_robot,
        add_obstacle,
        move_obstacle,
        set_obstacle,
        remove_obstacle,
        name_region,
        add_area,
        rename_area,
        remove_area,
        set_value,
        repair,
    )
}
