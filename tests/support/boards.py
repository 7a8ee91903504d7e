"""Parts of random missions that all families share: maps, models, objectives, obstacles.

Everything follows from a ``Random``; each piece is plain data, as a scenario's YAML holds it.
"""

from itertools import islice
from random import Random
from typing import Any

import networkx

from campaigns.judge.joint import Poses
from campaigns.judge.mission import HEADINGS, Mission, read_mission

ACTIONS = ("push", "sense", "clear", "lift")

Data = dict[str, Any]


class Draft:
    """A scenario in the making, on a grid of rows of text."""

    def __init__(self, random: Random, grid: list[str], name: str) -> None:
        self.random = random
        self.grid = grid
        self.cols = len(grid[0])
        self.free = free_in(grid)
        self.models: dict[str, Data] = {}
        self.types: dict[str, Data] = {}
        self.robots: dict[str, Data] = {}
        self.obstacles: list[Data] = []
        self.name = name

    def beside(self, region: int) -> list[int]:
        return [
            r
            for r in (region - self.cols, region + 1, region + self.cols, region - 1)
            if r in set(self.free)
        ]

    def narrow(self) -> list[int]:
        """Regions with walls on two opposite sides: doorways and corridors."""
        free = set(self.free)
        return [
            r
            for r in self.free
            if not ({r - 1, r + 1} & free and {r - self.cols, r + self.cols} & free)
        ]

    def data(self, rounds: int, ticks: int, seed: int) -> Data:
        return {
            "safenav": 1,
            "name": self.name,
            "map": {"grid": self.grid},
            "robots": self.robots,
            "obstacles": self.obstacles,
            "catalogue": {"robots": self.models, "obstacles": self.types},
            "until": {"rounds": rounds},
            "limits": {"ticks": ticks},
            "seed": seed,
        }

    def mission(self) -> Mission:
        return read_mission(self.data(1, 1, 0))

    def robot(self, name: str, model: str, start: int, objective: Data, **more: Any) -> None:
        entry: Data = {"model": model, "start": start, "objective": objective, **more}
        if self._mobility(model) == "heading":
            entry["heading"] = self.random.choice(HEADINGS)
        self.robots[name] = entry

    def place(
        self, name: str, model: str, kinds: tuple[str, ...], taken: set[int], **more: Any
    ) -> bool:
        """Add a robot at a free start with an objective that it could pursue forever alone; return
        False if a dozen attempts find none."""
        choice = [region for region in self.free if region not in taken]
        for _ in range(12 if choice else 0):
            start = self.random.choice(choice)
            kind = self.random.choice(kinds)
            self.robot(name, model, start, self.objective(kind, start), **more)
            if self.can_go_on(name):
                taken.add(start)
                return True
        self.robots.pop(name, None)
        return False

    def objective(self, kind: str, start: int) -> Data:
        random = self.random
        match kind:
            case "hold":
                return {"hold": random.choice(self.free)}
            case "patrol":
                return {"patrol": random.sample(self.free, 2)}
            case "ltl":
                goals = random.sample(self.free, random.randint(1, min(2, len(self.free))))
                never = [r for r in random.sample(self.free, 1) if r not in goals and r != start]
                found = {"liveness": [f"region = {goal}" for goal in goals]}
                if never and random.random() < 0.5:
                    found["safety"] = [f"region' != {region}" for region in never]
                return {"ltl": found}
            case "ltl_steps":
                found = self.objective("ltl", start)["ltl"]
                for _ in range(random.randint(0, 2)):
                    step = random.choice(self.free)
                    beside = self.beside(step)
                    if beside:
                        line = f"region = {step} -> region' != {random.choice(beside)}"
                        found["safety"] = [*found.get("safety", []), line]
                return {"ltl": found}
            case _:
                count = min(random.randint(1, 3), len(self.free))
                targets: list[Any] = random.sample(self.free, count)
                if len(self.free) > count + 1 and random.random() < 0.15:
                    other = random.choice([r for r in self.free if r not in targets])
                    targets[-1] = {"any": [targets[-1], other]}
                return {kind: targets}

    def timing(self) -> Any:
        return self.random.choice([1, 1, 1, 2, 3])

    def obstacle(self, kind: str, region: int, **more: Any) -> bool:
        """Add an obstacle of the type, unless the region has one or is a robot's start."""
        taken = {one["region"] for one in self.obstacles}
        starts = {robot["start"] for robot in self.robots.values()}
        if region in taken or region in starts:
            return False
        self.obstacles.append({"type": kind, "region": region, **more})
        return True

    def _mobility(self, model: str) -> str:
        if model in self.models:
            return str(self.models[model]["mobility"])
        return {"digit": "heading", "quadcopter": "free"}[model]

    def can_go_on(self, name: str) -> bool:
        mission = self.mission()
        robot = next(robot for robot in mission.robots if robot.name == name)
        graph = Poses(mission, robot)
        start = graph.index.get(robot.start)
        if start is None or not robot.stays:
            return start is not None and bool(graph.live(frozenset()) >> start & 1)
        reached = 1 << start
        for target in robot.targets:
            reached = graph.closure(reached, frozenset()) & graph.at(target)
        return bool(reached & graph.live(frozenset()))


def rooms(random: Random, down: int, across: int, height: int, width: int) -> list[str]:
    """Rooms with doors one region wide, between the neighbours of a tree and some others."""
    rows, cols = down * (height + 1) + 1, across * (width + 1) + 1
    cells = [["#"] * cols for _ in range(rows)]
    for r in range(rows):
        for c in range(cols):
            if r % (height + 1) and c % (width + 1):
                cells[r][c] = "."
    joined: dict[tuple[int, int], tuple[int, int]] = {}

    def root(room: tuple[int, int]) -> tuple[int, int]:
        while room in joined:
            room = joined[room]
        return room

    pairs = [((r, c), (r, c + 1)) for r in range(down) for c in range(across - 1)]
    pairs += [((r, c), (r + 1, c)) for r in range(down - 1) for c in range(across)]
    random.shuffle(pairs)
    for one, other in pairs:
        if root(one) == root(other) and random.random() > 0.3:
            continue
        if root(one) != root(other):
            joined[root(one)] = root(other)
        top, left = one[0] * (height + 1), one[1] * (width + 1)
        if one[0] == other[0]:
            cells[top + random.randint(1, height)][left + width + 1] = "."
        else:
            cells[top + height + 1][left + random.randint(1, width)] = "."
    return ["".join(row) for row in cells]


def walled(random: Random, rows: int, cols: int, walls: float) -> list[str]:
    """A room with walls in it."""
    cells = ("#" if random.random() < walls else "." for _ in range(rows * cols))
    return framed(["".join(islice(cells, cols)) for _ in range(rows)])


def scattered(random: Random, rows: int, cols: int, walls: float) -> list[str]:
    """A room with walls in it, all free regions connected: the largest part is kept."""
    graph = networkx.grid_2d_graph(rows, cols)
    cells = [(r, c) for r in range(rows) for c in range(cols)]
    graph.remove_nodes_from([cell for cell in cells if random.random() < walls])
    parts = networkx.connected_components(graph)
    kept = max(parts, key=lambda part: (len(part), min(part)), default=set())
    return framed(
        ["".join("." if (r, c) in kept else "#" for c in range(cols)) for r in range(rows)]
    )


def corridor(random: Random, length: int) -> list[str]:
    """A corridor one region wide, with one or two bays."""
    bays = random.sample(range(length), random.randint(1, 2))
    return framed(["." * length, "".join("." if k in bays else "#" for k in range(length))])


def open_floor(rows: int, cols: int) -> list[str]:
    return framed(["." * cols] * rows)


def framed(body: list[str]) -> list[str]:
    """The rows inside an outer wall."""
    wall = "#" * (len(body[0]) + 2)
    return [wall, *(f"#{row}#" for row in body), wall]


def free_in(grid: list[str]) -> list[int]:
    return [region for region, cell in enumerate("".join(grid)) if cell == "."]
