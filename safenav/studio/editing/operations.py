"""What the drawing does to the text: one function an operation, each on the data of the text.

An operation is an object with ``op`` and what it needs. Regions are numbers, robots their names,
obstacles their index.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.scalarstring import LiteralScalarString

from safenav.errors import UsageError
from safenav.studio.editing.places import LISTS, OBJECTIVES, Places
from safenav.studio.editing.round_trip import changed, parsed

Operation = Mapping[str, Any]

MOST = 512
NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
PLACE = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")


def edited(text: str, operation: Operation) -> str:
    """The text after an operation. Raises UsageError for one that cannot be."""
    does = OPERATIONS.get(str(operation.get("op")))
    if does is None:
        raise UsageError(f"the drawing cannot '{str(operation.get('op'))[:40]}'")
    try:
        return changed(text, lambda data: does(data, operation))
    except (KeyError, TypeError, IndexError, AttributeError, ValueError) as error:
        raise UsageError(f"that cannot be drawn in this text ({type(error).__name__})") from error


def paint(data: Any, told: Operation) -> None:
    """``regions`` become walls, or floor (``wall`` false)."""
    places = Places(data)
    rows = [list(row) for row in places.grid]
    for region in told["regions"]:
        places.written(region, 0)
        rows[region // places.cols][region % places.cols] = "#" if told["wall"] else "."
    _draw(data, ["".join(row) for row in rows])


def resize(data: Any, told: Operation) -> None:
    """So many rows and columns more (or less) at each side; regions stay where they are."""
    places = Places(data)
    top, bottom, left, right = (int(told.get(side, 0)) for side in SIDES)
    rows, cols = places.rows + top + bottom, places.cols + left + right
    if not (1 <= rows <= MOST and 1 <= cols <= MOST):
        raise UsageError(f"a map has 1 to {MOST} rows and columns")
    moved = [(value, put, places.read(value)) for value, put in places.each()]
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
    if min(rows, cols) > 2:  # what was the border opens where the map grows
        grid = _opened(grid, places.grid, (top, bottom, left, right))
    _draw(data, grid)
    after = Places(data)
    for value, put, region in moved:
        if region is None or isinstance(value, str):
            continue
        row = min(max(region // before + top, 0), rows - 1)
        col = min(max(region % before + left, 0), cols - 1)
        put(after.written(row * cols + col, value if isinstance(value, int) else [0, 0]))


SIDES = ("top", "bottom", "left", "right")


def _opened(grid: list[str], old: list[str], grown: tuple[int, int, int, int]) -> list[str]:
    """The floor goes on to the new border where the map has grown beyond a wall all along."""
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


def add_robot(data: Any, told: Operation) -> None:
    """A robot of ``model`` at ``region`` that stays there, until it gets an objective."""
    places = Places(data)
    robots = data.get("robots")
    if not isinstance(robots, dict):
        robots = data["robots"] = CommentedMap()
    if len(robots) == 0 and isinstance(robots, CommentedMap):
        robots.fa.set_block_style()
    name = str(told.get("name") or _new_name(str(told["model"]), robots))
    _check_name(name, robots)
    like: Any = next(
        (r["start"] for r in robots.values() if isinstance(r, dict) and "start" in r), []
    )
    start = places.written(told["region"], like)
    robot = CommentedMap({"model": told["model"], "start": start})
    if told.get("heading"):
        robot["heading"] = told["heading"]
    hold = CommentedMap({"hold": places.written(told["region"], like)})
    hold.fa.set_flow_style()
    robot["objective"] = hold
    robot.fa.set_flow_style()
    robots[name] = robot


def move_robot(data: Any, told: Operation) -> None:
    robot, places = _robot(data, told), Places(data)
    before = places.read(robot.get("start"))
    robot["start"] = places.written(told["region"], robot.get("start"))
    objective = robot.get("objective")
    held = objective.get("hold") if isinstance(objective, dict) else None
    if held is not None and places.read(held) == before:  # it held where it stood
        objective["hold"] = places.written(told["region"], held)


def set_heading(data: Any, told: Operation) -> None:
    if told["heading"] not in ("north", "east", "south", "west"):
        raise UsageError("a heading is north, east, south or west")
    _put(_robot(data, told), "heading", told["heading"], after="start")


def set_model(data: Any, told: Operation) -> None:
    robot = _robot(data, told)
    robot["model"] = told["model"]
    if told.get("turns") and "heading" not in robot:
        _put(robot, "heading", "north", after="start")


def set_objective(data: Any, told: Operation) -> None:
    """``kind`` with ``regions`` in order."""
    robot, places = _robot(data, told), Places(data)
    kind, regions = told["kind"], list(told["regions"])
    if kind not in OBJECTIVES:
        raise UsageError(f"an objective is one of {', '.join(OBJECTIVES)}")
    if not regions:
        raise UsageError("an objective needs a region")
    like: Any = robot.get("start", [])
    written = [places.written(region, like) for region in regions]
    value: Any = written[0]
    if kind != "hold":
        value = CommentedSeq(written)
        value.fa.set_flow_style()
    objective = CommentedMap({kind: value})
    objective.fa.set_flow_style()
    robot["objective"] = objective


def rename_robot(data: Any, told: Operation) -> None:
    robots, old, new = data["robots"], str(told["robot"]), str(told["name"])
    _robot(data, told)
    if old == new:
        return
    _check_name(new, robots)
    index = list(robots).index(old)
    robot = robots.pop(old)
    robots.insert(index, new, robot)
    for other in robots.values():
        for key in ("avoids", "tracks"):
            listed = other.get(key) if isinstance(other, dict) else None
            if isinstance(listed, list) and old in listed:
                listed[listed.index(old)] = new
    for change in _changes_of(data, old):
        change["robot"] = new


def remove_robot(data: Any, told: Operation) -> None:
    _robot(data, told)
    del data["robots"][told["robot"]]
    if not data["robots"]:
        data["robots"] = CommentedMap()
    for change in _changes_of(data, told["robot"]):
        data["changes"].remove(change)
    if data.get("changes") == []:
        del data["changes"]


def add_obstacle(data: Any, told: Operation) -> None:
    """An obstacle of ``type`` at ``region``; ``from``, ``until`` and ``traversable`` if given."""
    places = Places(data)
    obstacles = _listed(data, "obstacles", after="robots")
    like = next((o["region"] for o in obstacles if isinstance(o, dict) and "region" in o), None)
    if like is None:
        like = next((r.get("start") for r in (data.get("robots") or {}).values()), [])
    new = CommentedMap({"type": told["type"], "region": places.written(told["region"], like)})
    for key in ("traversable", "from", "until"):
        if told.get(key) is not None:
            new[key] = told[key]
    new.fa.set_flow_style()
    obstacles.append(new)


def add_change(data: Any, told: Operation) -> None:
    """What ``robot`` is told at tick ``at``: an ``objective`` (kind and regions as numbers, several
    for a target of which any counts), or ``service``."""
    new = CommentedMap({"at": told["at"], "robot": told["robot"]})
    if told.get("objective") is not None:
        ((kind, body),) = told["objective"].items()
        targets = [_any_of(target) for target in (body if kind in LISTS else [body])]
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


def _any_of(target: Any) -> Any:
    if not isinstance(target, list):
        return target
    regions = CommentedSeq(target)
    regions.fa.set_flow_style()
    found = CommentedMap({"any": regions})
    found.fa.set_flow_style()
    return found


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
    obstacle, places = _obstacle(data, told), Places(data)
    obstacle["region"] = places.written(told["region"], obstacle.get("region"))


def set_obstacle(data: Any, told: Operation) -> None:
    """``key`` (traversable, from, until, type) to ``value``; null takes it away."""
    obstacle = _obstacle(data, told)
    key, value = told["key"], told.get("value")
    if key not in ("traversable", "from", "until", "type"):
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


def name_region(data: Any, told: Operation) -> None:
    """``name`` for ``region``; an empty one takes the region's name away."""
    places, name = Places(data), str(told.get("name") or "")
    world = data["map"]
    used = {value for value, _ in places.each() if isinstance(value, str)}
    for old in [n for n, value in places.names.items() if places.read(value) == told["region"]]:
        if old in used and old != name:
            raise UsageError(f"'{old}' is used in the scenario: change that first")
        del world["names"][old]
    if name:
        if not PLACE.fullmatch(name):
            raise UsageError("a name has letters, digits, '_' and '-', and begins with a letter")
        if not isinstance(world.get("names"), dict):
            world["names"] = CommentedMap()
            world["names"].fa.set_flow_style()
        world["names"][name] = places.written(told["region"], [])
    if isinstance(world.get("names"), dict) and not world["names"]:
        del world["names"]


def set_value(data: Any, told: Operation) -> None:
    """A plain setting: ``name``, ``rounds``, ``ticks`` or ``seed``."""
    key, value = told["key"], told["value"]
    if key in ("name", "seed"):
        _put(data, key, value, after="safenav" if key == "name" else "limits")
    elif key in ("rounds", "ticks"):
        holder = "until" if key == "rounds" else "limits"
        if not isinstance(data.get(holder), dict):
            data[holder] = CommentedMap()
            data[holder].fa.set_flow_style()
        data[holder][key] = int(value)
    else:
        raise UsageError(f"'{str(key)[:40]}' is no setting of the drawing")


def repair(data: Any, told: Operation) -> None:
    """The changes of a repair (explain): items and their new values, as they would be written."""
    for item, value in told["change"]:
        walls = re.fullmatch(r"no wall at ([\d, ]+)", value)
        if item == "map" and walls is not None:
            paint(data, {"regions": [int(r) for r in walls[1].split(",")], "wall": False})
        elif item == "obstacles":
            told_obstacle = parsed(value)
            place = {"region": Places(data).read(told_obstacle["region"])}
            add_obstacle(data, {**told_obstacle, **place})
        else:
            holder = data
            *way, last = str(item).split(".")
            for key in way:
                if not isinstance(holder.get(key), dict):
                    holder[key] = CommentedMap()
                holder = holder[key]
            holder[last] = parsed(value)


def _robot(data: Any, told: Operation) -> Any:
    robots = data.get("robots")
    if not isinstance(robots, dict) or not isinstance(robots.get(told.get("robot")), dict):
        raise UsageError(f"there is no robot '{str(told.get('robot'))[:40]}'")
    return robots[told["robot"]]


def _changes_of(data: Any, robot: str) -> list[Any]:
    """What a robot is told while the run goes on."""
    listed = data.get("changes")
    entries = listed if isinstance(listed, list) else ()
    return [entry for entry in entries if isinstance(entry, dict) and entry.get("robot") == robot]


def _obstacle(data: Any, told: Operation) -> Any:
    obstacles, index = data.get("obstacles"), told.get("index")
    if not isinstance(obstacles, list) or not isinstance(index, int):
        raise UsageError("there is no such obstacle")
    if not 0 <= index < len(obstacles) or not isinstance(obstacles[index], dict):
        raise UsageError("there is no such obstacle")
    return obstacles[index]


def _put(holder: Any, key: str, value: Any, *, after: str) -> None:
    if key in holder or after not in holder or not hasattr(holder, "insert"):
        holder[key] = value
    else:
        holder.insert(list(holder).index(after) + 1, key, value)


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


def _check_name(name: str, robots: Any) -> None:
    if not NAME.fullmatch(name):
        raise UsageError("a robot's name has letters, digits and '_', and begins with a letter")
    if name in robots:
        raise UsageError(f"there is a robot '{name}' already")


def _new_name(model: str, robots: Any) -> str:
    stem = re.sub(r"\W", "_", model)[:20]
    stem = {"quadcopter": "quad"}.get(stem, stem)
    stem = stem if NAME.fullmatch(stem) else "robot"
    if stem not in robots:
        return stem
    return next(f"{stem}_{n}" for n in range(2, 1000) if f"{stem}_{n}" not in robots)


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
        rename_robot,
        remove_robot,
        add_obstacle,
        move_obstacle,
        set_obstacle,
        remove_obstacle,
        name_region,
        set_value,
        repair,
    )
}
