"""A random mission in the making, piece by piece: what the loader refuses is drawn again, or left
out."""

import json
from collections.abc import Callable, Sequence
from copy import deepcopy
from dataclasses import dataclass
from random import Random
from typing import Any

from campaigns.judge.mission import Mission, NotJudgedError
from campaigns.judge.search import Poses
from safenav import InputError, load_scenario_text
from support.floors import free_in

ACTIONS = ("push", "sense", "clear", "lift")
HEADINGS = ("north", "east", "south", "west")
OBJECTIVES = ("patrol", "visit", "visit", "cover", "cover", "hold")
SIDES = (0.8, 1.0, 1.25, 1.5, 1.8, 2.0, 2.4, 2.7, 3.3, 4.0)
"""Metres of a region: a walker needs 1.8."""

Data = dict[str, Any]
Floor = Callable[[Random], list[str]]


@dataclass(frozen=True)
class Family:
    """Random missions of a few robots in little space: the choices of floors, numbers of robots and
    objectives, and the chances that robots never hinder each other (``apart``) and have a heading,
    and that an obstacle has several needs (``needs``), or comes late and goes (``passing``).
    ``hidden``: the least and the most obstacles; ``rounds``: the most; ``keys``: choices of how
    many further keys there are; ``more``: the chance of each key that restricts a robot;
    ``formulas``: that its objective is a formula with memory; ``scale``: of times; ``tracks``: all
    are apart, and track each other; ``metric``: in metres, on either clock."""

    floors: Sequence[Floor]
    robots: Sequence[int] = (2, 2, 3)
    kinds: tuple[str, ...] = OBJECTIVES
    apart: float = 0.0
    heading: float = 0.35
    hidden: tuple[int, int] = (0, 0)
    needs: float = 0.0
    passing: float = 0.0
    rounds: int = 2
    ticks: int = 3000
    keys: Sequence[int] = ()
    more: float = 0.0
    formulas: float = 0.0
    scale: int = 1
    tracks: bool = False
    metric: bool = False


class Draft:
    """A scenario in the making, on a grid of rows of text."""

    def __init__(self, random: Random, grid: list[str], name: str, rounds: int, ticks: int) -> None:
        self.random, self.cols, self.free = random, len(grid[0]), free_in(grid)
        self.data: Data = {
            "safenav": 1,
            "name": name,
            "map": {"grid": grid},
            "catalogue": {"robots": {}, "obstacles": {}},
            "robots": {},
            "obstacles": [],
            "until": {"rounds": rounds},
            "limits": {"ticks": ticks, "synthesis_seconds": 20},
            "seed": random.randrange(1000),
        }

    @property
    def robots(self) -> Data:
        return self.data["robots"]  # type: ignore[no-any-return]

    @property
    def models(self) -> Data:
        return self.data["catalogue"]["robots"]  # type: ignore[no-any-return]

    def chance(self, share: float) -> bool:
        return self.random.random() < share

    def accepted(self, **other: Any) -> bool:
        """Whether the loader accepts the scenario, perhaps with ``other`` keys."""
        try:
            load_scenario_text(json.dumps(self.data | other))
        except InputError:
            return False
        return True

    def kept(self, change: Callable[[], object], attempts: int = 4) -> bool:
        """Make a random change, one that the loader accepts; return False if there is none."""
        before = self.data
        for _ in range(attempts):
            self.data = deepcopy(before)
            change()
            if self.data != before and self.accepted():
                return True
        self.data = before
        return False

    def narrow(self) -> list[int]:
        """Regions with walls on two opposite sides: doorways and corridors."""
        free, cols = {*self.free}, self.cols
        beside = ((r, {r - 1, r + 1}, {r - cols, r + cols}) for r in self.free)
        return [r for r, row, col in beside if not (row & free and col & free)]

    def place(self, name: str, model: str, draw: Callable[[int], Data], **more: Any) -> bool:
        """Add a robot at a free start with an objective (``draw``) that it can pursue forever;
        return False if a dozen attempts find none."""
        free = [r for r in self.free if all(r != each["start"] for each in self.robots.values())]

        def add() -> None:
            start = self.random.choice(free)
            self.robots[name] = {"model": model, "start": start, "objective": draw(start), **more}
            turns = self.models[model]["mobility"] == "heading" if model in self.models else True
            if (turns and model != "quadcopter") or self.chance(0.3):
                self.robots[name]["heading"] = self.random.choice(HEADINGS)

        return bool(free) and any(self.kept(add) and self._lasts(name) for _ in range(4))

    def _lasts(self, name: str) -> bool:
        """Whether a robot alone can obey its formulas forever, as far as the judge reads them."""
        if "ltl" not in self.robots[name]["objective"]:
            return True
        try:
            mission = Mission(self.data | {"robots": {name: self.robots[name]}, "obstacles": []})
            robot = mission.robots[name]
        except NotJudgedError:
            return True
        return robot.start in Poses(mission, robot).live(frozenset())

    def targets(self, kind: str) -> Data:
        """An objective of this kind, without rules beside it."""
        random, free = self.random, self.free
        if kind == "hold":
            return {kind: random.choice(free)}
        count = 2 + self.chance(0.2) if kind == "patrol" else random.choice([1, 2, 2, 3])
        found: list[Any] = random.sample(free, min(count, len(free)))
        others = [r for r in free if r not in found]
        if others and kind != "patrol" and self.chance(0.15):
            found[-1] = {"any": [found[-1], random.choice(others)]}
        return {kind: found}

    def obstacle(self, kind: str, region: int, **more: Any) -> bool:
        """Add an obstacle of the type, unless the region has one or is a robot's start."""
        taken = {one["region"] for one in self.data["obstacles"]}
        if region in taken | {robot["start"] for robot in self.robots.values()}:
            return False
        self.data["obstacles"].append({"type": kind, "region": region, **more})
        return True
