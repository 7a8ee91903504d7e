"""A mission as the judge sees it, read from a scenario's data by code of its own.

It reads the part of docs/scenario.md that the campaigns generate (grids in place, regions as
numbers or row and column, formulas of three shapes) and raises ``NotJudgedError`` for the rest. It
shares nothing with safenav, so that an error there cannot be repeated here.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

HEADINGS = ("north", "east", "south", "west")
STEPS = ((-1, 0), (0, 1), (1, 0), (0, -1))
NO_HEADING = -1

Pose = tuple[int, int]
"""A region, and the index of a heading or ``NO_HEADING``."""

BUILT_IN_ROBOTS: dict[str, dict[str, Any]] = {
    "digit": {"mobility": "heading", "layer": "ground", "capabilities": ["push"]},
    "quadcopter": {"mobility": "free", "layer": "air", "capabilities": ["sense"]},
}
BUILT_IN_OBSTACLES: dict[str, dict[str, Any]] = {
    "door": {"action": "push", "resolve_at": "self"},
    "uncertainty": {
        "action": "sense",
        "resolve_at": "neighbours",
        "has_truth": True,
        "blocks": ["ground"],
    },
}

GOAL = re.compile(r"^region = (\d+)$")
NEVER = re.compile(r"^region' != (\d+)$")
ONE_WAY = re.compile(r"^region = (\d+) -> region' != (\d+)$")


KNOWN: dict[str, str] = {
    "": "safenav name map robots obstacles catalogue until limits seed coordination clock expect",
    "until": "rounds",
    "robot": "model start heading objective avoids vision tracks",
    "objective": "patrol visit cover once hold ltl form",
    "model": "mobility layer capabilities timing vision size speed motion",
    "obstacle": "type region from until traversable",
    "type": "action resolve_at has_truth blocks needs",
    "need": "action at robots together",
}
"""Keys that the judge knows; a mission with others is not judged."""


class NotJudgedError(Exception):
    """The scenario uses a feature that the judge does not know."""


@dataclass(frozen=True)
class Robot:
    """``in_order``: whether its targets are met in turn (``cover``: in any order); ``stays``: each
    once, and the mission ends with it at the last one. ``forbidden``:
    regions that its own formulas exclude, ``closed``: steps between regions that they exclude.
    ``either_first``: whether it may begin at any target, since a patrol begins with the other one
    if only that is possible."""

    name: str
    has_heading: bool
    layer: str
    capabilities: frozenset[str]
    start: Pose
    targets: tuple[frozenset[int], ...]
    in_order: bool = True
    either_first: bool = False
    stays: bool = False
    forbidden: frozenset[int] = frozenset()
    closed: frozenset[tuple[int, int]] = frozenset()
    formulas: bool = False


@dataclass(frozen=True)
class Need:
    """``robots`` distinct ones perform ``action`` on regions ``at``, ``together`` or in any
    order one after the other."""

    action: str
    robots: int
    at: frozenset[int]
    together: bool


@dataclass(frozen=True)
class Obstacle:
    """``blocks``: names of the robots that it physically stops, capable or not. ``since``:
    the tick at which it appears."""

    name: str
    region: int
    needs: tuple[Need, ...]
    blocks: frozenset[str]
    since: int | None


@dataclass(frozen=True)
class Mission:
    cols: int
    free: frozenset[int]
    robots: tuple[Robot, ...]
    obstacles: Mapping[str, Obstacle]
    conflicts: Mapping[str, frozenset[str]]
    rounds: int

    def neighbour(self, region: int, way: int) -> int | None:
        """The free region one step away, or None."""
        south, east = STEPS[way]
        col = region % self.cols + east
        to = region + south * self.cols + east
        return to if 0 <= col < self.cols and to in self.free else None

    def steps(self, robot: Robot, pose: Pose) -> list[Pose]:
        """Return the poses one step away: with a heading, never backwards."""
        region, heading = pose
        found = []
        for way in range(4):
            to = self.neighbour(region, way)
            if to is None or to in robot.forbidden or (region, to) in robot.closed:
                continue
            if not robot.has_heading:
                found.append((to, NO_HEADING))
            elif way != (heading + 2) % 4:
                found.append((to, way))
        return found

    def blocked(self, robot: Robot, obstacle: Obstacle, need: int) -> bool:
        """Return whether the robot may not enter: the obstacle blocks it, and entering does not
        fulfil the only remaining need."""
        left = obstacle.needs[need:]
        enters = (
            len(left) == 1
            and left[0].robots == 1
            and obstacle.region in left[0].at
            and left[0].action in robot.capabilities
        )
        return robot.name in obstacle.blocks and not enters


def read_mission(data: Mapping[str, Any]) -> Mission:
    """The mission of a scenario's data (as YAML gives it)."""
    grid = data["map"].get("grid")
    if grid is None:
        raise NotJudgedError("the map is in another file")
    rows = grid.split() if isinstance(grid, str) else list(grid)
    cols = len(rows[0])
    place = Places(cols, data["map"].get("names") or {})
    free = frozenset(
        r * cols + c for r, row in enumerate(rows) for c, cell in enumerate(row) if cell != "#"
    )
    own = data.get("catalogue") or {}
    models = BUILT_IN_ROBOTS | own.get("robots", {})
    types = BUILT_IN_OBSTACLES | own.get("obstacles", {})
    entries = data["robots"]
    robots = tuple(_robot(name, entry, models, place) for name, entry in entries.items())
    obstacles = [
        _obstacle(entry, types, entries, models, free, place) for entry in data.get("obstacles", [])
    ]
    return Mission(
        cols,
        free,
        robots,
        {one.name: one for one in obstacles},
        conflicts_of({robot.name: robot.layer for robot in robots}, entries),
        (data.get("until") or {}).get("rounds", 2),
    )


def judged_mission(data: Mapping[str, Any]) -> Mission:
    """The mission of a scenario's data, all keys of which the judge knows."""
    own = data.get("catalogue") or {}
    types = [*(own.get("obstacles") or {}).values()]
    found: list[tuple[str, Mapping[str, Any]]] = [("", data), ("until", data.get("until") or {})]
    found += [("robot", robot) for robot in data["robots"].values()]
    found += [("objective", robot["objective"]) for robot in data["robots"].values()]
    found += [("model", model) for model in (own.get("robots") or {}).values()]
    found += [("obstacle", each) for each in data.get("obstacles") or ()]
    found += [("type", each) for each in types]
    found += [("need", need) for each in types for need in each.get("needs", ())]
    for kind, written in found:
        if others := written.keys() - KNOWN[kind].split():
            raise NotJudgedError(f"the key {min(others)} of {kind or 'a scenario'}")
    return read_mission(data)


class Places:
    """Regions as a scenario writes them."""

    def __init__(self, cols: int, names: Mapping[str, Any]) -> None:
        self.cols = cols
        self.names = names

    def one(self, written: Any) -> int:
        if isinstance(written, str) and written in self.names:
            return self.one(self.names[written])
        if isinstance(written, int):
            return written
        if isinstance(written, list) and len(written) == 2:
            return written[0] * self.cols + written[1]
        raise NotJudgedError(f"a region written as {written!r}")

    def any(self, written: Any) -> frozenset[int]:
        if isinstance(written, dict):
            return frozenset(map(self.one, written["any"]))
        return frozenset([self.one(written)])

    def around(self, region: int, free: frozenset[int]) -> frozenset[int]:
        row, col = divmod(region, self.cols)
        beside = [(row + south, col + east) for south, east in STEPS]
        return frozenset(r * self.cols + c for r, c in beside if 0 <= c < self.cols) & free


def _robot(name: str, entry: Mapping[str, Any], models: Mapping[str, Any], at: Places) -> Robot:
    model = models[entry["model"]]
    has_heading = model["mobility"] == "heading"
    heading = HEADINGS.index(entry["heading"]) if has_heading else NO_HEADING
    ((kind, written),) = ((k, v) for k, v in entry["objective"].items() if k != "form")
    in_order, formulas = True, False
    forbidden, closed = frozenset[int](), frozenset[tuple[int, int]]()
    match kind:
        case "patrol" | "visit" | "cover" | "once":
            targets = tuple(map(at.any, written))
            in_order = kind != "cover"
        case "hold":
            targets = (at.any(written),)
        case "ltl":
            targets, forbidden, closed = _formulas(written)
            formulas = True
        case _:
            raise NotJudgedError(f"the objective {kind}")
    return Robot(
        name,
        has_heading,
        model["layer"],
        frozenset(model.get("capabilities", ())),
        (at.one(entry["start"]), heading),
        targets,
        in_order,
        kind == "patrol" or formulas,
        kind in ("hold", "once"),
        forbidden,
        closed,
        formulas,
    )


def _formulas(
    written: Mapping[str, Any],
) -> tuple[tuple[frozenset[int], ...], frozenset[int], frozenset[tuple[int, int]]]:
    """Targets, forbidden regions, forbidden steps."""
    targets, forbidden, closed = [], [], []
    if "memory" in written or "init" in written:
        raise NotJudgedError("a memory")
    for line in written.get("liveness", []):
        goal = GOAL.match(line)
        if goal is None:
            raise NotJudgedError(f"the goal {line}")
        targets.append(frozenset([int(goal[1])]))
    for line in written.get("safety", []):
        never, one_way = NEVER.match(line), ONE_WAY.match(line)
        if never is not None:
            forbidden.append(int(never[1]))
        elif one_way is not None:
            closed.append((int(one_way[1]), int(one_way[2])))
        else:
            raise NotJudgedError(f"the formula {line}")
    return tuple(targets), frozenset(forbidden), frozenset(closed)


def _obstacle(
    entry: Mapping[str, Any],
    types: Mapping[str, Any],
    robots: Mapping[str, Any],
    models: Mapping[str, Any],
    free: frozenset[int],
    place: Places,
) -> Obstacle:
    kind = types[entry["type"]]
    region = place.one(entry["region"])
    needs = kind.get("needs") or [{"action": kind["action"], "at": kind.get("resolve_at", "self")}]
    listed = kind.get("blocks")
    blocks = [
        name
        for name, robot in robots.items()
        if listed is None or {name, robot["model"], models[robot["model"]]["layer"]} & set(listed)
    ]
    return Obstacle(
        f"{entry['type']}@{region}",
        region,
        tuple(_need(need, region, free, place) for need in needs),
        frozenset(blocks),
        entry.get("from"),
    )


def _need(need: Mapping[str, Any], region: int, free: frozenset[int], place: Places) -> Need:
    at = need.get("at", "self")
    match at:
        case "self":
            where = frozenset([region])
        case "neighbours":
            where = place.around(region, free)
        case _:
            where = frozenset(map(place.one, at))
    return Need(need["action"], need.get("robots", 1), where, bool(need.get("together")))


def conflicts_of(
    layers: Mapping[str, str], entries: Mapping[str, Any]
) -> Mapping[str, frozenset[str]]:
    """Two robots keep apart as soon as one of them avoids the other. ``layers``: of all robots."""

    def avoids(one: str, other: str) -> bool:
        listed = entries[one].get("avoids")
        return layers[one] == layers[other] if listed is None else other in listed

    return {
        one: frozenset(
            other for other in layers if other != one and (avoids(one, other) or avoids(other, one))
        )
        for one in layers
    }
