"""Operations of the drawing on the text: one function per operation, each on the data of the text;
operations on robots and on the map have their own modules.

An operation is an object with ``op`` and its arguments. Regions are given by number, robots by
name, obstacles by index.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import count
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.error import YAMLError

from safenav.errors import UsageError
from safenav.scenario.reading.catalogue import LIBRARY
from safenav.studio.editing import robots, walls
from safenav.studio.editing.keys import ordered_keys
from safenav.studio.editing.places import LISTS, MapPlaces, any_of
from safenav.studio.editing.round_trip import Operation, changed, inline, parsed, put


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


def add_delivery(data: Any, edit: Operation) -> None:
    """Add an order of a new type in tick ``at``: one robot takes a load from the region ``from``
    and puts it down in ``to``, both by ``action``."""
    places = MapPlaces(data)
    types = in_catalogue(data, "obstacles")
    name = next(n for n in _numbered("parcel") if n not in types)
    ends = [inline([places.written(edit[key], [])]) for key in ("from", "to")]
    needs = [inline({"action": edit["action"], "at": end}) for end in ends]
    needs[1]["same"] = True
    types[name] = CommentedMap({"needs": inline(needs), "blocks": inline([])})
    add_order(data, {"at": edit["at"], "type": name, "region": edit["from"]})


def _numbered(stem: str) -> Iterator[str]:
    yield stem
    yield from (f"{stem}_{number}" for number in count(2))


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
    """Move an obstacle to ``region``. ``list``: ``orders`` for an order, as in ``set_obstacle`` and
    ``remove_obstacle``."""
    obstacle, places = _obstacle(data, edit), MapPlaces(data)
    obstacle["region"] = places.written(edit["region"], obstacle.get("region"))


SETTINGS = ("traversable", "from", "until", "type", "resolve_within", "at")
"""The keys of an obstacle or an order that can be set."""


def set_obstacle(data: Any, edit: Operation) -> None:
    """Set ``key`` (one of SETTINGS) to ``value``; null removes it."""
    obstacle = _obstacle(data, edit)
    key, value = edit["key"], edit.get("value")
    if key not in SETTINGS:
        raise UsageError(f"an obstacle has no '{str(key)[:40]}'")
    if value is None:
        obstacle.pop(key, None)
    else:
        obstacle[key] = value


def remove_obstacle(data: Any, edit: Operation) -> None:
    _obstacle(data, edit)
    listed = _list_of(edit)
    del data[listed][edit["index"]]
    if not data[listed]:
        del data[listed]


def set_charger(data: Any, edit: Operation) -> None:
    """Add a charger in ``region``, or remove it (``on`` false)."""
    places, region = MapPlaces(data), edit["region"]
    chargers = data.get("chargers")
    if not isinstance(chargers, list):
        put(data, "chargers", inline([]), after="orders" if "orders" in data else "robots")
        chargers = data["chargers"]
    there = [index for index, value in enumerate(chargers) if places.read(value) == region]
    if edit["on"] and not there:
        chargers.append(places.written(region, chargers[0] if chargers else []))
    for index in reversed([] if edit["on"] else there):
        del chargers[index]
    if not chargers:
        del data["chargers"]


def set_part(data: Any, edit: Operation) -> None:
    """Set ``key`` of the mapping at ``path`` (names and numbers) to the value of the YAML ``text``;
    an empty text removes the key."""
    holder = data
    for step in edit["path"]:
        holder = holder[step]
    key, text = str(edit["key"]), str(edit["text"])
    known = ordered_keys(edit["path"])
    if key not in known or not isinstance(holder, dict):
        raise UsageError(f"there is no key '{key[:40]}' here")
    if not text.strip():
        holder.pop(key, None)
        return
    try:
        value = parsed(text, flow="\n" not in text.strip())
    except YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = "" if mark is None else f", line {mark.line + 1} of the field"
        raise UsageError(f"{key} is not valid YAML{where}") from error
    before = [k for k in known[: known.index(key)] if k in holder]
    put(holder, key, value, after=before[-1] if before else "")


def own(data: Any, edit: Operation) -> None:
    """Copy the built-in robot model or obstacle type ``name`` into the scenario's own catalogue,
    where it can be changed. ``of``: ``robots`` or ``obstacles``."""
    kind, name = edit["of"], edit["name"]
    if kind not in ("robots", "obstacles"):
        raise UsageError("a catalogue has robots and obstacles")
    known = YAML(typ="safe", pure=True).load(LIBRARY / f"{kind}.yaml")[kind]
    own_ones = in_catalogue(data, kind)
    if name in own_ones:
        return
    if name not in known:
        raise UsageError(f"'{str(name)[:40]}' is not built in")
    own_ones[name] = CommentedMap()
    for key, value in known[name].items():
        own_ones[name][key] = parsed(json.dumps(value))


def in_catalogue(data: Any, kind: str) -> Any:
    """Return the ``robots`` or ``obstacles`` of the scenario's own catalogue; create them if
    missing. Raises UsageError if the catalogue is a file."""
    if not isinstance(data.get("catalogue"), dict):
        if data.get("catalogue") is not None:
            raise UsageError("the catalogue is a file: change it there")
        data.pop("catalogue", None)
        index = list(data).index("robots") if "robots" in data else len(data)
        data.insert(index, "catalogue", CommentedMap())
    catalogue = data["catalogue"]
    if not isinstance(catalogue.get(kind), dict):
        catalogue[kind] = CommentedMap()
        catalogue.fa.set_block_style()
    return catalogue[kind]


def set_value(data: Any, edit: Operation) -> None:
    """Set ``name``, ``rounds``, ``ticks`` or ``seed``."""
    key, value = edit["key"], edit["value"]
    if key in ("name", "seed"):
        put(data, key, value, after="safenav" if key == "name" else "limits")
    elif key in ("rounds", "ticks"):
        holder = "until" if key == "rounds" else "limits"
        if not isinstance(data.get(holder), dict):
            data[holder] = inline({})
        data[holder][key] = int(value)
    else:
        raise UsageError(f"'{str(key)[:40]}' is not a setting of the drawing")


def repair(data: Any, edit: Operation) -> None:
    """Apply the changes of a repair (``safenav explain``): items and their new values as YAML."""
    for item, value in edit["change"]:
        freed = re.fullmatch(r"no wall at ([\d, ]+)", value)
        if item == "map" and freed is not None:
            walls.paint(data, {"regions": [int(r) for r in freed[1].split(",")], "wall": False})
        elif item == "obstacles":
            told_obstacle = parsed(value)
            place = {"region": MapPlaces(data).read(told_obstacle["region"])}
            add_obstacle(data, {**told_obstacle, **place})
        elif item != "partition":  # ``walls.paint`` has changed it
            holder = data
            *way, last = str(item).split(".")
            for key in way:
                if not isinstance(holder.get(key), dict):
                    holder[key] = CommentedMap()
                holder = holder[key]
            holder[last] = parsed(value)


def _obstacle(data: Any, edit: Operation) -> Any:
    obstacles, index = data.get(_list_of(edit)), edit.get("index")
    known = isinstance(obstacles, list) and index in range(len(obstacles))
    if not known or not isinstance(obstacles[index], dict):
        raise UsageError("there is no such obstacle")
    return obstacles[index]


def _list_of(edit: Operation) -> str:
    return "orders" if edit.get("list") == "orders" else "obstacles"


OPERATIONS: Mapping[str, Callable[[Any, Operation], None]] = {
    found.__name__: found
    for found in (
        *(walls.paint, walls.resize, walls.name_region),
        *(walls.add_area, walls.rename_area, walls.remove_area),
        *(robots.add_robot, robots.move_robot, robots.set_heading, robots.set_model),
        *(robots.set_objective, robots.set_form, robots.rename_robot, robots.remove_robot),
        *(add_obstacle, move_obstacle, set_obstacle, remove_obstacle, add_order, add_delivery),
        *(set_charger, set_part, own, set_value, repair),
    )
}
