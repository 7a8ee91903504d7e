"""Operations of the drawing on the robots of a text; ``robot`` is the robot's name."""

from __future__ import annotations

import re
from itertools import chain
from typing import Any

from ruamel.yaml.comments import CommentedMap

from safenav.errors import UsageError
from safenav.scenario.objective import KINDS, STAYING
from safenav.scenario.reading.objective import FORM, RULES, STRICT, TIMED, WITHIN
from safenav.studio.editing.places import OBJECTIVES, MapPlaces, any_of
from safenav.studio.editing.round_trip import Operation, inline, put

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


def add_robot(data: Any, edit: Operation) -> None:
    """Add a robot of ``model`` that holds ``region`` until it is assigned an objective."""
    places = MapPlaces(data)
    robots = data.get("robots")
    if not isinstance(robots, dict):
        robots = data["robots"] = CommentedMap()
    if len(robots) == 0 and isinstance(robots, CommentedMap):
        robots.fa.set_block_style()
    name = str(edit.get("name") or _new_name(str(edit["model"]), robots))
    _check_name(name, robots)
    like: Any = next(
        (r["start"] for r in robots.values() if isinstance(r, dict) and "start" in r), []
    )
    start = places.written(edit["region"], like)
    robot = inline({"model": edit["model"], "start": start})
    if edit.get("heading"):
        robot["heading"] = edit["heading"]
    robot["objective"] = inline({STAYING.kind: places.written(edit["region"], like)})
    robots[name] = robot


def move_robot(data: Any, edit: Operation) -> None:
    robot, places = _robot(data, edit), MapPlaces(data)
    before = places.read(robot.get("start"))
    robot["start"] = places.written(edit["region"], robot.get("start"))
    objective = robot.get("objective")
    held = objective.get(STAYING.kind) if isinstance(objective, dict) else None
    if held is not None and places.read(held) == before:  # it held its start
        objective[STAYING.kind] = places.written(edit["region"], held)


def set_heading(data: Any, edit: Operation) -> None:
    if edit["heading"] not in ("north", "east", "south", "west"):
        raise UsageError("a heading is north, east, south or west")
    put(_robot(data, edit), "heading", edit["heading"], after="start")


def set_objective(data: Any, edit: Operation) -> None:
    """Set the objective ``kind`` with ``regions`` in order: numbers, lists of numbers of which any
    counts, or names of areas."""
    robot, places = _robot(data, edit), MapPlaces(data)
    kind, regions = edit["kind"], list(edit["regions"])
    if kind not in OBJECTIVES:
        raise UsageError(f"an objective is one of {', '.join(OBJECTIVES)}")
    if not regions:
        raise UsageError("an objective needs a region")
    like: Any = robot.get("start", [])
    written = [_target(target, places, like) for target in regions]
    value = written[0] if KINDS[kind].one else inline(written)
    before = robot.get("objective")
    beside = ((FORM,) * (kind in STRICT), (WITHIN,) * (kind in TIMED), RULES)
    kept = before if isinstance(before, dict) else {}
    others = {key: kept[key] for key in chain(*beside) if key in kept}
    robot["objective"] = inline({kind: value} | others)


def _target(target: Any, places: MapPlaces, like: Any) -> Any:
    if isinstance(target, str) and target in (places.data.get("areas") or {}):
        return target
    if isinstance(target, list):
        return any_of([_target(region, places, like) for region in target])
    name = places.written(target)
    return name if isinstance(name, str) else places.written(target, like)


def remove_robot(data: Any, edit: Operation) -> None:
    _robot(data, edit)
    del data["robots"][edit["robot"]]
    if not data["robots"]:
        data["robots"] = CommentedMap()


def _robot(data: Any, edit: Operation) -> Any:
    robots = data.get("robots")
    if not isinstance(robots, dict) or not isinstance(robots.get(edit.get("robot")), dict):
        raise UsageError(f"there is no robot '{str(edit.get('robot'))[:40]}'")
    return robots[edit["robot"]]


def _check_name(name: str, robots: Any) -> None:
    if not NAME.fullmatch(name):
        raise UsageError("a robot's name has letters, digits and '_', and begins with a letter")
    if name in robots:
        raise UsageError(f"a robot '{name}' already exists")


def _new_name(model: str, robots: Any) -> str:
    stem = re.sub(r"\W", "_", model)[:20]
    stem = {"quadcopter": "quad"}.get(stem, stem)
    stem = stem if NAME.fullmatch(stem) else "robot"
    if stem not in robots:
        return stem
    return next(f"{stem}_{n}" for n in range(2, 1000) if f"{stem}_{n}" not in robots)
