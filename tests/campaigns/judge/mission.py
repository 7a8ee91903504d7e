"""A mission as the judge sees it, read from a scenario's data by code of its own.

It reads the part of docs/scenario.md that the campaigns generate (grids in place, regions as
numbers or row and column, formulas of three shapes) and raises ``NotJudgedError`` for the rest. It
shares nothing with safenav, so that an error there cannot be repeated here.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
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


class Reader:
    """Reads parts of a scenario's data (as YAML gives it). ``layers``: those of the robots;
    ``conflicts``: two robots keep apart as soon as one of them avoids the other."""

    def __init__(self, data: Mapping[str, Any]) -> None:
        grid = data["map"].get("grid")
        if grid is None:
            raise NotJudgedError("the map is in another file")
        rows = grid.split() if isinstance(grid, str) else list(grid)
        cells = enumerate("".join(rows))
        own = data.get("catalogue") or {}
        self.free, self.cols = frozenset(k for k, cell in cells if cell != "#"), len(rows[0])
        self.names = data["map"].get("names") or {}
        self.types = BUILT_IN_OBSTACLES | own.get("obstacles", {})
        self.robots = data["robots"]
        models = BUILT_IN_ROBOTS | own.get("robots", {})
        self.models = {name: models[entry["model"]] for name, entry in self.robots.items()}
        self.layers = {name: model["layer"] for name, model in self.models.items()}
        self.conflicts = {
            one: frozenset(
                other
                for other in self.robots
                if other != one and (self._avoids(one, other) or self._avoids(other, one))
            )
            for one in self.robots
        }

    def _avoids(self, one: str, other: str) -> bool:
        listed = self.robots[one].get("avoids")
        return self.layers[one] == self.layers[other] if listed is None else other in listed

    def start(self, name: str) -> Pose:
        turns, entry = self.models[name]["mobility"] == "heading", self.robots[name]
        return self._one(entry["start"]), HEADINGS.index(entry["heading"]) if turns else NO_HEADING

    def robot(self, name: str) -> Robot:
        model = self.models[name]
        objective = self.robots[name]["objective"]
        ((kind, written),) = ((k, v) for k, v in objective.items() if k != "form")
        forbidden, closed = frozenset[int](), frozenset[tuple[int, int]]()
        match kind:
            case "patrol" | "visit" | "cover" | "once":
                targets = tuple(map(self._any, written))
            case "hold":
                targets = (self._any(written),)
            case "ltl":
                targets, forbidden, closed = _formulas(written)
            case _:
                raise NotJudgedError(f"the objective {kind}")
        return Robot(
            name,
            model["mobility"] == "heading",
            model["layer"],
            frozenset(model.get("capabilities", ())),
            self.start(name),
            targets,
            in_order=kind != "cover",
            either_first=kind in ("patrol", "ltl"),
            stays=kind in ("hold", "once"),
            forbidden=forbidden,
            closed=closed,
            formulas=kind == "ltl",
        )

    def obstacle(self, entry: Mapping[str, Any]) -> Obstacle:
        kind, region = self.types[entry["type"]], self._one(entry["region"])
        alone = {"action": kind.get("action"), "at": kind.get("resolve_at", "self")}
        listed = kind.get("blocks")
        blocks = frozenset(
            name
            for name, robot in self.robots.items()
            if listed is None or {name, robot["model"], self.layers[name]} & set(listed)
        )
        needs = tuple(self._need(need, region) for need in kind.get("needs") or [alone])
        return Obstacle(f"{entry['type']}@{region}", region, needs, blocks, entry.get("from"))

    def _need(self, need: Mapping[str, Any], region: int) -> Need:
        match need.get("at", "self"):
            case "self":
                where = frozenset([region])
            case "neighbours":
                row, col = divmod(region, self.cols)
                beside = [(row + south, col + east) for south, east in STEPS]
                regions = frozenset(r * self.cols + c for r, c in beside if 0 <= c < self.cols)
                where = regions & self.free
            case listed:
                where = frozenset(map(self._one, listed))
        return Need(need["action"], need.get("robots", 1), where, bool(need.get("together")))

    def _any(self, written: Any) -> frozenset[int]:
        return frozenset(map(self._one, written["any"] if isinstance(written, dict) else [written]))

    def _one(self, written: Any) -> int:
        if isinstance(written, str) and written in self.names:
            return self._one(self.names[written])
        if isinstance(written, int):
            return written
        if isinstance(written, list) and len(written) == 2:
            return int(written[0] * self.cols + written[1])
        raise NotJudgedError(f"a region written as {written!r}")


def read_mission(data: Mapping[str, Any]) -> Mission:
    """The mission of a scenario's data."""
    reader = Reader(data)
    robots = tuple(map(reader.robot, reader.robots))
    obstacles = [reader.obstacle(entry) for entry in data.get("obstacles", [])]
    rounds = (data.get("until") or {}).get("rounds", 2)
    named = {one.name: one for one in obstacles}
    return Mission(reader.cols, reader.free, robots, named, reader.conflicts, rounds)


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


# Situations of a mission, from which the judge decides whether it can still be completed.


class Answer(Enum):
    """Whether the mission can be completed."""

    YES = "yes"
    NO = "no"
    OVER_BUDGET = "over budget"


Stage = tuple[int, frozenset[str]]
"""Of an obstacle: the index of the next need, and who has performed it already."""

FIRST: Stage = (0, frozenset())

Progress = tuple[int, int]
"""Of a robot: what is next (``in_order``: an index; otherwise the targets covered, bit by bit),
and how many goals (otherwise: rounds) it has met since the last resolution."""


@dataclass(frozen=True)
class Situation:
    """A moment of a mission. ``stages``: the obstacles that are known and unresolved; those not
    listed are absent. ``sealed``: those found to be permanent."""

    poses: Mapping[str, Pose]
    progress: Mapping[str, Progress]
    stages: Mapping[str, Stage]
    sealed: frozenset[str] = frozenset()


def at_start(mission: Mission) -> Situation:
    """Return the situation before the first move: hidden obstacles count as absent."""
    return Situation(
        {robot.name: robot.start for robot in mission.robots},
        {robot.name: (0, 0) for robot in mission.robots},
        {},
    )


def walls(
    mission: Mission, name: str, stages: Mapping[str, Stage], sealed: frozenset[str]
) -> frozenset[int]:
    """The regions that obstacles close to a robot."""
    robot = next(one for one in mission.robots if one.name == name)

    def closes(obstacle: Obstacle) -> bool:
        if obstacle.name in sealed:
            return name in obstacle.blocks
        stage = stages.get(obstacle.name)
        return stage is not None and mission.blocked(robot, obstacle, stage[0])

    return frozenset(one.region for one in mission.obstacles.values() if closes(one))
