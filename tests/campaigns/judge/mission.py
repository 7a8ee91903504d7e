"""A mission as the judge sees it, read from a scenario's data by code of its own.

It reads the part of docs/scenario.md that the campaigns generate (grids in place, regions as
numbers or row and column, formulas of three shapes), and raises ``NotJudgedError`` for the rest. It
shares nothing with safenav, so that an error there cannot be repeated here.
"""

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

HEADINGS = ("north", "east", "south", "west")
STEPS = ((-1, 0), (0, 1), (1, 0), (0, -1))
NO_HEADING = -1

Pose = tuple[int, int]
"""A region, and the index of a heading or ``NO_HEADING``."""
Data = Mapping[str, Any]

BUILT_IN_ROBOTS: dict[str, Data] = {
    "digit": {"mobility": "heading", "layer": "ground", "capabilities": ["push"]},
    "quadcopter": {"mobility": "free", "layer": "air", "capabilities": ["sense"]},
}
BUILT_IN_OBSTACLES: dict[str, Data] = {
    "door": {"action": "push", "resolve_at": "self"},
    "uncertainty": {"action": "sense", "resolve_at": "neighbours", "blocks": ["ground"]},
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
    once, and the mission ends with it at the last one. ``forbidden``: regions that its own formulas
    exclude, ``closed``: steps between regions that they exclude. ``either_first``: whether it may
    begin at any target, since a patrol begins with the other one if only that is possible."""

    name: str
    has_heading: bool
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


Stage = tuple[int, frozenset[str]]
"""An obstacle's next need, as an index, and the robots that have already performed it."""

FIRST: Stage = (0, frozenset())


class Mission:
    """The mission of a scenario's data. ``layers``: those of the robots; ``conflicts``: two robots
    keep apart as soon as one of them avoids the other; ``barred``: robots, each with an obstacle on
    which they cannot act."""

    def __init__(self, data: Data, barred: Collection[tuple[str, str]] = ()) -> None:
        grid = data["map"].get("grid")
        if grid is None:
            raise NotJudgedError("the map is in another file")
        rows = grid.split() if isinstance(grid, str) else list(grid)
        self.data, self.barred, self.cols = data, barred, len(rows[0])
        self.free = frozenset(k for k, cell in enumerate("".join(rows)) if cell != "#")
        self.rounds = (data.get("until") or {}).get("rounds", 2)
        self._names, self._robots = data["map"].get("names") or {}, data["robots"]
        own = data.get("catalogue") or {}
        self._types, models = BUILT_IN_OBSTACLES | own.get("obstacles", {}), own.get("robots", {})
        models = BUILT_IN_ROBOTS | models
        self._models = {name: models[entry["model"]] for name, entry in self._robots.items()}
        self.layers = {name: model["layer"] for name, model in self._models.items()}
        self.conflicts = {
            one: frozenset(
                other
                for other in self._robots
                if other != one and (self._avoids(one, other) or self._avoids(other, one))
            )
            for one in self._robots
        }

    def _avoids(self, one: str, other: str) -> bool:
        listed = self._robots[one].get("avoids")
        return self.layers[one] == self.layers[other] if listed is None else other in listed

    def start(self, name: str) -> Pose:
        turns, entry = self._models[name]["mobility"] == "heading", self._robots[name]
        return self._one(entry["start"]), HEADINGS.index(entry["heading"]) if turns else NO_HEADING

    @cached_property
    def robots(self) -> dict[str, Robot]:
        return {name: self._robot(name) for name in self._robots}

    def _robot(self, name: str) -> Robot:
        model, objective = self._models[name], self._robots[name]["objective"]
        ((kind, written),) = ((k, v) for k, v in objective.items() if k != "form")
        if kind not in ("patrol", "visit", "cover", "once", "hold", "ltl"):
            raise NotJudgedError(f"the objective {kind}")
        regions = () if kind == "ltl" else [written] if kind == "hold" else written
        robot = Robot(
            name,
            model["mobility"] == "heading",
            frozenset(model.get("capabilities", ())),
            self.start(name),
            tuple(map(self._any, regions)),
            in_order=kind != "cover",
            either_first=kind in ("patrol", "ltl"),
            stays=kind in ("hold", "once"),
            formulas=kind == "ltl",
        )
        return replace(robot, **_formulas(written)) if robot.formulas else robot

    @cached_property
    def obstacles(self) -> dict[str, Obstacle]:
        found = dict[str, Obstacle]()  # the first of each name
        for obstacle in map(self._obstacle, self.data.get("obstacles") or ()):
            found.setdefault(obstacle.name, obstacle)
        return found

    def _obstacle(self, entry: Data) -> Obstacle:
        kind, region = self._types[entry["type"]], self._one(entry["region"])
        alone = {"action": kind.get("action"), "at": kind.get("resolve_at", "self")}
        listed = kind.get("blocks")
        blocks = frozenset(
            name
            for name, robot in self._robots.items()
            if listed is None or {name, robot["model"], self.layers[name]} & set(listed)
        )
        needs = tuple(self._need(need, region) for need in kind.get("needs") or [alone])
        return Obstacle(f"{entry['type']}@{region}", region, needs, blocks, entry.get("from"))

    def _need(self, need: Data, region: int) -> Need:
        match need.get("at", "self"):
            case "self":
                where = frozenset([region])
            case "neighbours":
                beside = (self.neighbour(region, way) for way in range(4))
                where = frozenset(each for each in beside if each is not None)
            case listed:
                where = frozenset(map(self._one, listed))
        return Need(need["action"], need.get("robots", 1), where, bool(need.get("together")))

    def _any(self, written: Any) -> frozenset[int]:
        return frozenset(map(self._one, written["any"] if isinstance(written, dict) else [written]))

    def _one(self, written: Any) -> int:
        if isinstance(written, str) and written in self._names:
            return self._one(self._names[written])
        if isinstance(written, int):
            return written
        if isinstance(written, list) and len(written) == 2:
            return int(written[0] * self.cols + written[1])
        raise NotJudgedError(f"a region written as {written!r}")

    # -- what robots can do ------------------------------------------------------------------

    def neighbour(self, region: int, way: int) -> int | None:
        """The free region one step away, or None."""
        south, east = STEPS[way]
        to = region + south * self.cols + east
        return to if 0 <= region % self.cols + east < self.cols and to in self.free else None

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

    def turned(self, heading: int, origin: int, to: int) -> int:
        """The heading after a step, of a robot that has one."""
        ways = (-self.cols, 1, self.cols, -1)
        return heading if heading == NO_HEADING else ways.index(to - origin)

    def able(self, name: str, obstacle: Obstacle, need: Need) -> bool:
        capable = need.action in self.robots[name].capabilities
        return capable and (name, obstacle.name) not in self.barred

    def blocked(self, name: str, obstacle: Obstacle, stage: Stage) -> bool:
        """Return whether the robot may not enter: the obstacle blocks it, and entering does not
        fulfil the only remaining need."""
        left = obstacle.needs[stage[0] :]
        enters = (
            len(left) == 1
            and left[0].robots == 1
            and obstacle.region in left[0].at
            and self.able(name, obstacle, left[0])
        )
        return name in obstacle.blocks and not enters

    def performed(
        self, obstacle: Obstacle, stage: Stage, at: Mapping[str, int], acting: Iterable[str]
    ) -> Stage:
        """The stage after the acts of these robots where all stand: a robot continues with the next
        need."""
        index, done = stage
        while index < len(obstacle.needs):
            need = obstacle.needs[index]
            here = {n for n, r in at.items() if r in need.at and self.able(n, obstacle, need)}
            acts = here.intersection(acting)
            if need.together:
                acts = here if acts and len(here) >= need.robots else set()
            done = done.union(acts)
            if len(done) < need.robots:
                break
            index, done = index + 1, FIRST[1]
        return index, done


def judged_mission(data: Data) -> Mission:
    """The mission of a scenario's data, all keys of which the judge knows."""
    own = data.get("catalogue") or {}
    types = [*(own.get("obstacles") or {}).values()]
    found: list[tuple[str, Data]] = [("", data), ("until", data.get("until") or {})]
    found += [("robot", robot) for robot in data["robots"].values()]
    found += [("objective", robot["objective"]) for robot in data["robots"].values()]
    found += [("model", model) for model in (own.get("robots") or {}).values()]
    found += [("obstacle", each) for each in data.get("obstacles") or ()]
    found += [("type", each) for each in types]
    found += [("need", need) for each in types for need in each.get("needs", ())]
    for kind, written in found:
        if others := written.keys() - KNOWN[kind].split():
            raise NotJudgedError(f"the key {min(others)} of {kind or 'a scenario'}")
    mission = Mission(data)
    assert mission.robots, mission.obstacles  # all is read
    return mission


def _formulas(written: Data) -> dict[str, Any]:
    """Targets, forbidden regions and steps of formulas."""
    goals = [GOAL.match(line) for line in written.get("liveness", ())]
    rules = written.get("safety", ())
    nevers, steps = ([form.match(line) for line in rules] for form in (NEVER, ONE_WAY))
    if {"memory", "init"} & written.keys() or None in goals:
        raise NotJudgedError("a memory, or the goal of a formula")
    if any(never is None and step is None for never, step in zip(nevers, steps, strict=True)):
        raise NotJudgedError("a formula")
    return {
        "targets": tuple(frozenset([int(goal[1])]) for goal in goals if goal),
        "forbidden": frozenset(int(never[1]) for never in nevers if never),
        "closed": frozenset((int(step[1]), int(step[2])) for step in steps if step),
    }
