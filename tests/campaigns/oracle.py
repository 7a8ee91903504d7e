"""Who passes an obstacle that stands, and can a mission be completed? An oracle of its own.

It knows the grid, the robots, the obstacles and one rule: while an obstacle stands, no robot that
it blocks is in its region, unless the robot resolves it by entering. That is so where one need is
left, one robot suffices, the robot has the action, and the region is among those where it is
performed. It reads scenarios and traces as plain data and shares no code with safenav or the other
judge.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

HEADINGS = ("north", "east", "south", "west")
MODELS: dict[str, Any] = {
    "digit": {"mobility": "heading", "layer": "ground", "capabilities": ["push"]},
    "quadcopter": {"mobility": "free", "layer": "air", "capabilities": ["sense"]},
}
TYPES: dict[str, Any] = {
    "door": {"action": "push"},
    "uncertainty": {"action": "sense", "resolve_at": "neighbours", "blocks": ["ground"]},
}

Pose = tuple[int, int]
"""A region, and the index of a heading (-1: the robot has none)."""
Stage = tuple[int, frozenset[str]]
"""Index of the next need, and the robots that have fulfilled their part of it."""
Stages = tuple[tuple[str, Stage], ...]
FIRST: Stage = (0, frozenset())


@dataclass(frozen=True)
class Need:
    action: str
    robots: int
    at: frozenset[int]
    together: bool


@dataclass(frozen=True)
class Obstacle:
    region: int
    needs: tuple[Need, ...]
    blocks: frozenset[str]


class Lab:
    """A scenario: regions, robots and obstacles by name."""

    def __init__(self, data: Mapping[str, Any]) -> None:
        grid = data["map"]["grid"]
        rows = grid.split() if isinstance(grid, str) else grid
        self.cols, self.names = len(rows[0]), data["map"].get("names") or {}
        self.free = {k for k, cell in enumerate("".join(rows)) if cell == "."}
        own = data.get("catalogue") or {}
        models, types = MODELS | own.get("robots", {}), TYPES | own.get("obstacles", {})
        self.robots = data["robots"]
        self.model = {name: models[robot["model"]] for name, robot in self.robots.items()}
        self.can = {name: set(m.get("capabilities", ())) for name, m in self.model.items()}
        self.obstacles: dict[str, Obstacle] = {}
        self.present: set[str] = set()
        for entry in data.get("obstacles") or ():
            kind, region = types[entry["type"]], self.region(entry["region"])
            name = f"{entry['type']}@{region}"
            self.obstacles[name] = self._obstacle(kind, region)
            if not entry.get("from"):
                self.present.add(name)

    def region(self, written: Any) -> int:
        if isinstance(written, str):
            return self.region(self.names[written])
        return written if isinstance(written, int) else written[0] * self.cols + written[1]

    def beside(self, region: int) -> list[int | None]:
        """The free neighbours to the north, east, south and west."""
        steps = (-self.cols, 1, self.cols, -1)
        row = region // self.cols
        return [
            region + step
            if region + step in self.free and (abs(step) > 1 or (region + step) // self.cols == row)
            else None
            for step in steps
        ]

    def _obstacle(self, kind: Mapping[str, Any], region: int) -> Obstacle:
        needs = []
        for need in kind.get("needs") or [{**kind, "at": kind.get("resolve_at", "self")}]:
            at = need.get("at", "self")
            words = {"self": [region], "neighbours": self.beside(region)}
            where = words.get(str(at)) or map(self.region, at)
            found = frozenset(one for one in where if one is not None)
            together = need.get("together", False)
            needs.append(Need(need["action"], need.get("robots", 1), found, together))
        listed = kind.get("blocks")
        blocks = (
            name
            for name, robot in self.robots.items()
            if listed is None or {name, robot["model"], self.model[name]["layer"]} & set(listed)
        )
        return Obstacle(region, tuple(needs), frozenset(blocks))

    def keeps_out(self, obstacle: str, stage: Stage, robot: str) -> bool:
        """The rule."""
        one, need = self.obstacles[obstacle], self.obstacles[obstacle].needs[stage[0]]
        enters = (
            stage[0] == len(one.needs) - 1
            and one.region in need.at
            and need.robots == 1
            and need.action in self.can[robot]
        )
        return robot in one.blocks and not enters

    def act(
        self, obstacle: str, stage: Stage, who: set[str], at: Mapping[str, int]
    ) -> Stage | None:
        """The stage after the actions of ``who``, robots being ``at`` regions; None: resolved."""
        index, done = stage
        needs = self.obstacles[obstacle].needs
        while index < len(needs):
            need = needs[index]
            here = {r for r in self.can if need.action in self.can[r] and at[r] in need.at}
            if not here & who:
                return index, done
            group = here if need.together else done | (here & who)
            if len(group) < need.robots:
                return index, done if need.together else frozenset(group)
            index, done = index + 1, frozenset()
        return None


class Walk:
    """A trace followed by its moves: ``entries`` are the robots found where they must not be, and
    resolutions that the moves and the lines do not agree on; then the moment of the end."""

    def __init__(self, data: Mapping[str, Any], lines: Sequence[Mapping[str, Any]]) -> None:
        self.lab = Lab(data)
        self.at = {name: self.lab.region(robot["start"]) for name, robot in data["robots"].items()}
        self.heading = {name: robot.get("heading") for name, robot in data["robots"].items()}
        self.bound: dict[str, int | None] = dict.fromkeys(self.at)
        self.standing = dict.fromkeys(self.lab.present, FIRST)
        self.shut: set[str] = set()
        self.met: set[str] = set()
        self.open: set[str] = set()  # resolved by the moves, not yet by a line
        self.entries: list[str] = []
        for line in lines:
            self._follow(line, line.get("obstacle"))
        self.entries += [f"{name} is resolved, and no line says so" for name in self.open]

    def _follow(self, line: Mapping[str, Any], obstacle: Any) -> None:
        match line["type"]:
            case "move":
                self._move(line, line["robot"])
            case "violation":
                self.met.add(obstacle)
            case "resolved":
                if obstacle not in self.open:
                    self.entries.append(f"tick {line['tick']}: only a line resolves {obstacle}")
                self.open.discard(obstacle)
                self.standing.pop(obstacle, None)
                self.shut.discard(obstacle)
            case "blocked":
                self.shut.add(obstacle)
            case "appeared":
                self.standing[obstacle] = FIRST
                self.met.discard(obstacle)
                self.shut.discard(obstacle)
            case "gone":
                self.standing.pop(obstacle, None)
                self.shut.discard(obstacle)

    def _move(self, line: Mapping[str, Any], robot: str) -> None:
        there = {line["to"], line.get("toward")}
        for name, one in self.lab.obstacles.items():
            stage = self.standing.get(name)
            if name in self.shut:
                inside = robot in one.blocks and one.region != self.at[robot]
            else:
                inside = stage is not None and self.lab.keeps_out(name, stage, robot)
            if inside and one.region in there:
                self.entries.append(f"tick {line['tick']}: {robot} is in {name}")
        self.at[robot], self.bound[robot] = line["to"], line.get("toward")
        self.heading[robot] = line["heading"]
        for name, stage in list(self.standing.items()):
            after = self.lab.act(name, stage, {robot}, self.at)
            if after is None:
                self.open.add(name)
                del self.standing[name]
            else:
                self.standing[name] = after

    def pose(self, robot: str) -> Pose:
        """Where the robot stands, or its step under way ends."""
        bound, region = self.bound[robot], self.at[robot]
        if self.lab.model[robot]["mobility"] != "heading":
            return (region if bound is None else bound), -1
        if bound is None:
            return region, HEADINGS.index(self.heading[robot])
        return bound, self.lab.beside(region).index(bound)


Places = tuple[Pose, ...]
Counts = tuple[int, ...]
State = tuple[Places, Counts, Stages]


class Search:
    """Can the team complete its mission from the end of a walk? Exact for small maps.

    What no robot has met is absent. One robot at a time steps into a region that no robot in
    conflict with it is in; then all act. Completed: since the last resolution each robot has met
    its targets ``rounds`` times, counted from the first one (of a patrol: either one), and could
    go on alone.
    """

    def __init__(self, data: Mapping[str, Any], walk: Walk) -> None:
        self.lab, self.shut = walk.lab, walk.shut
        self.names = list(self.lab.robots)
        self.rounds = (data.get("until") or {}).get("rounds", 2)
        self.begin = tuple(map(walk.pose, self.names))
        met = sorted((walk.met & walk.standing.keys()) - self.shut)
        self.stages: Stages = tuple((name, walk.standing[name]) for name in met)
        self.kind, self.targets = {}, {}
        for name, robot in self.lab.robots.items():
            ((self.kind[name], written),) = robot["objective"].items()
            each = [written] if self.kind[name] == "hold" else written
            self.targets[name] = [
                {self.lab.region(r) for r in (t["any"] if isinstance(t, dict) else [t])}
                for t in each
            ]
        self.apart = {
            (k, j)
            for (k, one), (j, other) in product(enumerate(self.names), repeat=2)
            if k != j and (self._avoids(one, other) or self._avoids(other, one))
        }
        self.closed = cache(self._closed)
        self.live = cache(self._live)

    def _avoids(self, one: str, other: str) -> bool:
        layers = self.lab.model[one]["layer"], self.lab.model[other]["layer"]
        return other in self.lab.robots[one].get("avoids", [other] * (layers[0] == layers[1]))

    def _closed(self, robot: str, stages: Stages) -> frozenset[int]:
        shut = {name for name in self.shut if robot in self.lab.obstacles[name].blocks}
        shut |= {name for name, stage in stages if self.lab.keeps_out(name, stage, robot)}
        return frozenset(self.lab.obstacles[name].region for name in shut)

    def steps(self, robot: str, pose: Pose, closed: frozenset[int]) -> list[Pose]:
        ways = enumerate(self.lab.beside(pose[0]))
        turns = self.lab.model[robot]["mobility"] == "heading"
        return [
            (to, way if turns else -1)
            for way, to in ways
            if to is not None and to not in closed and not (turns and way == (pose[1] + 2) % 4)
        ]

    def reach(self, robot: str, start: Iterable[Pose], closed: frozenset[int]) -> set[Pose]:
        found, new = set(start), set(start)
        while new:
            new = {to for pose in new for to in self.steps(robot, pose, closed)} - found
            found |= new
        return found

    def _live(self, robot: str, pose: Pose, closed: frozenset[int]) -> bool:
        """Whether the robot alone can meet each of its targets for ever."""
        inside = self.reach(robot, [pose], closed)
        while True:
            good = set(inside)
            for target in self.targets[robot]:
                on = {one for one in good if one[0] in target}
                grown = True
                while grown:
                    more = {p for p in good - on if on & set(self.steps(robot, p, closed))}
                    grown = bool(more)
                    on |= more
                good = on
            if good == inside:
                return pose in inside
            inside = good

    def hopeless(self) -> bool:
        """Whether some robot cannot go on even if no robot were ever in another's way."""
        poses: dict[str, set[Pose]] = {}
        stages = self.stages
        while True:
            for name, begin in zip(self.names, self.begin, strict=True):
                poses[name] = self.reach(name, [begin], self.closed(name, stages))
            after = []
            for obstacle, (index, done) in stages:
                need = self.lab.obstacles[obstacle].needs[index]
                able = {
                    name
                    for name, reached in poses.items()
                    if need.action in self.lab.can[name] and any(p[0] in need.at for p in reached)
                }
                if len(able | done) < need.robots:
                    after.append((obstacle, (index, done)))
                elif index + 1 < len(self.lab.obstacles[obstacle].needs):
                    after.append((obstacle, (index + 1, FIRST[1])))
            if tuple(after) == stages:
                break
            stages = tuple(after)
        return not all(
            any(self.live(name, pose, self.closed(name, stages)) for pose in poses[name])
            for name in self.names
        )

    def can_complete(self, budget: int = 200_000) -> bool | None:
        """None: more than ``budget`` states."""
        if self.hopeless():
            return False
        firsts = [(0, 1) if self.kind[name] == "patrol" else (0,) for name in self.names]
        pending: list[tuple[int, int, State, Counts]] = []
        seen = set()

        def add(state: State, first: Counts) -> None:
            if (state, first) not in seen:
                seen.add((state, first))
                left = sum(map(self._left, self.names, state[1]))
                heapq.heappush(pending, (4 * left + 9 * len(state[2]), len(seen), state, first))

        for first in product(*firsts):
            add(self.settled(self.begin, (0,) * len(first), self.stages, first), first)
        while pending and len(seen) < budget:
            _, _, state, first = heapq.heappop(pending)
            if self.complete(state):
                return True
            for places in self.moves(state):
                add(self.settled(places, state[1], state[2], first), first)
        return None if pending else False

    def moves(self, state: State) -> Iterable[Places]:
        places, _, stages = state
        for k, name in enumerate(self.names):
            taken = {place[0] for j, place in enumerate(places) if (k, j) in self.apart}
            for pose in self.steps(name, places[k], self.closed(name, stages)):
                if pose[0] not in taken:
                    yield (*places[:k], pose, *places[k + 1 :])

    def complete(self, state: State) -> bool:
        places, counts, stages = state
        return not any(map(self._left, self.names, counts)) and all(
            self.live(name, pose, self.closed(name, stages))
            for name, pose in zip(self.names, places, strict=True)
        )

    def settled(self, places: Places, counts: Counts, stages: Stages, first: Counts) -> State:
        """The state after all actions, with the targets that are met."""
        at = {name: pose[0] for name, pose in zip(self.names, places, strict=True)}
        after = [(name, self.lab.act(name, stage, set(at), at)) for name, stage in stages]
        left = tuple((name, stage) for name, stage in after if stage is not None)
        if len(left) < len(stages):
            counts = (0,) * len(counts)
        return places, tuple(map(self._count, self.names, at.values(), counts, first)), left

    def _count(self, robot: str, region: int, count: int, first: int) -> int:
        """In turn: targets met. In any order: rounds times all targets, plus a bit for each."""
        targets, wanted = self.targets[robot], self._wanted(robot)
        bits = sum(1 << k for k, target in enumerate(targets) if region in target)
        full = (1 << len(targets)) - 1
        before = -1
        while before != count < wanted:  # a robot that stays may meet several
            before = count
            if self.kind[robot] == "cover":
                covered = (count & full) | bits
                count = (count | full) + 1 if covered == full else count | bits
            else:
                count += bits >> (first + count) % len(targets) & 1
        return count

    def _wanted(self, robot: str) -> int:
        match self.kind[robot]:
            case "hold":
                return 1
            case "cover":
                return self.rounds << len(self.targets[robot])
            case _:
                return self.rounds * len(self.targets[robot])

    def _left(self, robot: str, count: int) -> int:
        return self._wanted(robot) - count


def judge(data: Mapping[str, Any], lines: Sequence[Mapping[str, Any]]) -> str:
    """The defects of a run: entries, or ``operator_needed`` though the mission can be completed;
    empty: none. ``?``: the search was too large."""
    walk = Walk(data, lines)
    if walk.entries:
        return "; ".join(walk.entries)
    formulas = any("ltl" in robot["objective"] for robot in data["robots"].values())
    if formulas or lines[-1].get("outcome") != "operator_needed":
        return ""
    answer = Search(data, walk).can_complete()
    return {None: "?", True: "it can be completed", False: ""}[answer]
