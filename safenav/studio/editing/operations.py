"""Operations of the drawing on the text: one function per operation, each on the data of the text;
operations on robots and on the map have their own modules.

An operation is an object with ``op`` and its arguments. Regions are given by number, robots by
name, obstacles by index.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from safenav.errors import UsageError
from safenav.studio.editing import robots
from safenav.studio.editing.places import LISTS, MapPlaces, any_of
from safenav.studio.editing.round_trip import Operation, changed, inline, parsed, put
from safenav.studio.editing.walls import paint


def edited(text: str, operation: Operation) -> str:
    """Return the text after an operation. Raises UsageError for an impossible one."""
    does = OPERATIONS.get(str(operation.get("op")))
    if does is None:
        raise UsageError(f"unknown edit '{str(operation.get('op'))[:40]}'")
    try:
        return changed(text, lambda data: does(data, operation))
    except (KeyError, TypeError, IndexError, AttributeError, ValueError) as error:
        raise UsageError(f"this edit does not fit the text ({type(error).__name__})") from error


def add_obstacle(data: Any, edit: Operation) -> None:
    """Add an obstacle of ``type`` at ``region``; ``from``, ``until``, ``traversable`` if given."""
    _add(data, "obstacles", "robots", ("type", "region", "traversable", "from", "until"), edit)


def add_order(data: Any, edit: Operation) -> None:
    """Add an order of ``type`` at ``region`` in tick ``at``."""
    _add(data, "orders", "obstacles", ("at", "type", "region"), edit)


def _add(data: Any, key: str, after: str, keys: Sequence[str], edit: Operation) -> None:
    """Add an entry to a list of the scenario, with its region in the notation of other entries."""
    places = MapPlaces(data)
    entries = _listed(data, key, after=after)
    like = next((e["region"] for e in entries if isinstance(e, dict) and "region" in e), None)
    if like is None:
        like = next((r.get("start") for r in (data.get("robots") or {}).values()), [])
    new = inline({each: edit[each] for each in keys if edit.get(each) is not None})
    new["region"] = places.written(edit["region"], like)
    entries.append(new)


def add_change(data: Any, edit: Operation) -> None:
    """Add a change for ``robot`` at tick ``at``: an ``objective`` (kind and targets, each a region
    number or a list of them of which any counts), or ``service``."""
    new = inline({"at": edit["at"], "robot": edit["robot"]})
    if edit.get("objective") is not None:
        ((kind, body),) = edit["objective"].items()
        targets = [any_of(target) for target in (body if kind in LISTS else [body])]
        new["objective"] = inline({kind: inline(targets) if kind in LISTS else targets[0]})
    else:
        new["service"] = edit["service"]
    _listed(data, "changes", after="obstacles" if "obstacles" in data else "robots").append(new)


def _listed(data: Any, key: str, *, after: str) -> Any:
    """Return the list at a key; create it after another key if it is missing."""
    listed = data.get(key)
    if not isinstance(listed, list):
        data.pop(key, None)
        put(data, key, CommentedSeq(), after=after)
        listed = data[key]
    if len(listed) == 0:
        listed.fa.set_block_style()
    return listed


def move_obstacle(data: Any, edit: Operation) -> None:
    """Move an obstacle to ``region``."""
    obstacle, places = _obstacle(data, edit), MapPlaces(data)
    obstacle["region"] = places.written(edit["region"], obstacle.get("region"))


def remove_obstacle(data: Any, edit: Operation) -> None:
    _obstacle(data, edit)
    del data["obstacles"][edit["index"]]
    if not data["obstacles"]:
        del data["obstacles"]


def repair(data: Any, edit: Operation) -> None:
    """Apply the changes of a repair (``safenav explain``): items and their new values as YAML."""
    for item, value in edit["change"]:
        freed = re.fullmatch(r"no wall at ([\d, ]+)", value)
        if item == "map" and freed is not None:
            paint(data, {"regions": [int(r) for r in freed[1].split(",")], "wall": False})
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


def _obstacle(data: Any, edit: Operation) -> Any:
    obstacles, index = data.get("obstacles"), edit.get("index")
    known = isinstance(obstacles, list) and index in range(len(obstacles))
    if not known or not isinstance(obstacles[index], dict):
        raise UsageError("there is no such obstacle")
    return obstacles[index]


OPERATIONS: Mapping[str, Callable[[Any, Operation], None]] = {
    found.__name__: found
    for found in (
        *(paint, add_obstacle, move_obstacle, remove_obstacle, repair),
        *(robots.add_robot, robots.move_robot, robots.remove_robot),
        *(robots.set_heading, robots.set_objective),
    )
}
