"""Traces made without the runtime: what the replay and the pictures are tested on.

A small simulator that walks robots along shortest paths and plays the coordination rules of
the design in their simplest form, so that the tests of the report neither need a synthesizer
nor change when the runtime does. The lines are those of docs/trace.md.
"""

import json
import random
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from safenav.world.map import Heading, Region, RegionMap
from safenav.world.moves import Mobility, Pose, moves

MODELS: dict[str, tuple[Mobility, str, tuple[str, ...]]] = {
    "digit": (Mobility.HEADING, "ground", ("push",)),
    "quadcopter": (Mobility.FREE, "air", ("sense",)),
}
ACTIONS = {"door": "push", "uncertainty": "sense"}

DOOR_MAP = """\
#############
#.......#...#
#.......#...#
#...#.......#
#.......#...#
#.......#...#
#############"""

CHAIN_MAP = """\
#############
#...#...#...#
#...#...#...#
#...........#
#...#...#...#
#...#...#...#
#############"""


@dataclass
class Walker:
    """One robot: where it is, what it is asked, which of its targets is next."""

    name: str
    model: str
    pose: Pose
    objective: dict[str, Any]
    next: int = 0
    rounds: int = 0
    plan: list[Pose] = field(default_factory=list)

    @property
    def targets(self) -> list[set[Region]]:
        written = next(iter(self.objective.values()))
        written = written if isinstance(written, list) else [written]
        return [set(t) if isinstance(t, list) else {t} for t in written]

    @property
    def capabilities(self) -> tuple[str, ...]:
        return MODELS[self.model][2]

    @property
    def layer(self) -> str:
        return MODELS[self.model][1]

    def assign(self, objective: dict[str, Any]) -> None:
        if objective != self.objective:
            self.objective, self.next, self.rounds, self.plan = objective, 0, 0, []


@dataclass
class Simulator:
    """Plays a team for some ticks and keeps the lines of its trace."""

    name: str
    world: RegionMap
    team: list[Walker]
    hidden: list[dict[str, Any]]
    rounds: int = 2
    known: dict[str, set[Region]] = field(default_factory=dict)
    stack: list[dict[str, Any]] = field(default_factory=list)
    lines: list[dict[str, Any]] = field(default_factory=list)
    tick: int = 0

    def run(self, ticks: int = 500) -> list[dict[str, Any]]:
        """The whole trace, ended by completion or by the limit of ticks."""
        self._header(ticks)
        for robot in self.team:
            self._synthesis(robot, "initial")
        while self.tick < ticks and not self._done():
            self.tick += 1
            for robot in self.team:
                self._turn(robot)
        done = self._done()
        seconds = [line["seconds"] for line in self.lines if line["type"] == "synthesis"]
        self._line(
            "outcome",
            outcome="completed" if done else "tick_limit",
            explanation=f"every robot met its objective {self.rounds} times"
            if done
            else f"the limit of {ticks} ticks was reached",
            rounds={r.name: r.rounds for r in self.team},
            ticks=self.tick,
            seconds=0.3,
            syntheses=len(seconds),
            synthesis_seconds=sum(seconds),
        )
        return self.lines

    def _done(self) -> bool:
        return not self.stack and all(r.rounds >= self.rounds for r in self.team)

    def _line(self, kind: str, **fields: Any) -> None:
        self.lines.append({"type": kind, "tick": self.tick, **fields})

    def _header(self, ticks: int) -> None:
        robots = {}
        for r in self.team:
            mobility, layer, capabilities = MODELS[r.model]
            robots[r.name] = {
                "model": r.model,
                "mobility": str(mobility),
                "layer": layer,
                "capabilities": list(capabilities),
                "start": r.pose.region,
                "heading": r.pose.heading.label if r.pose.heading is not None else None,
                "objective": r.objective,
            }
        for o in self.hidden:
            o["name"] = f"{o['type']}@{o['region']}"
            o.setdefault("traversable", None)
            o["action"] = ACTIONS[o["type"]]
            neighbours = sorted(self.world.neighbours(o["region"]))
            o["resolution_regions"] = [o["region"]] if o["type"] == "door" else neighbours
            o["blocks"] = [r.name for r in self.team if o["action"] not in r.capabilities]
        grid = {"rows": self.world.rows, "cols": self.world.cols, "grid": self.world.grid_rows()}
        scenario = {
            "name": self.name,
            "map": grid,
            "robots": robots,
            "obstacles": [dict(o) for o in self.hidden],
            "until": {"rounds": self.rounds},
            "limits": {"ticks": ticks},
            "seed": 0,
            "coordination": "resynthesis",
        }
        self.lines.append({"type": "header", "trace": 3, "safenav": "0.1.0", "scenario": scenario})

    def _synthesis(self, robot: Walker, reason: str) -> None:
        states = 22 + 7 * len(robot.name) + self.tick % 5
        self._line(
            "synthesis",
            robot=robot.name,
            reason=reason,
            verdict="realizable",
            seconds=0.004 + states / 10_000,
            states=states,
            cached=self.tick % 7 == 3,
            verified=True,
            spec="0" * 64,
            strategy="1" * 64,
            objective=robot.objective,
            assumptions=[],
        )

    def _barred(self, robot: Walker) -> set[Region]:
        """Where known obstacles and robots of the same layer are."""
        others = {o.pose.region for o in self.team if o is not robot and o.layer == robot.layer}
        return others | self.known.get(robot.name, set())

    def _next(self, robot: Walker) -> Pose:
        """The next pose on the way to the target in turn; a plan is kept while it holds."""
        targets, blocked = robot.targets[robot.next], self._barred(robot)
        plan = robot.plan
        if not plan or plan[-1].region not in targets or plan[0].region in blocked:
            plan = self._path(robot, targets)
        robot.plan = plan[1:]
        return plan[0] if plan else robot.pose

    def _path(self, robot: Walker, targets: set[Region]) -> list[Pose]:
        """A shortest path around what is barred; empty if there is none."""
        mobility, blocked = MODELS[robot.model][0], self._barred(robot)
        came: dict[Pose, Pose | None] = {robot.pose: None}
        queue = deque([robot.pose])
        while queue:
            pose = queue.popleft()
            if pose.region in targets:
                path = [pose]
                while (before := came[path[-1]]) is not None:
                    path.append(before)
                return path[::-1][1:]
            for after in moves(mobility, pose, self.world, blocked)[1:]:
                if after not in came:
                    came[after] = pose
                    queue.append(after)
        return []

    def _turn(self, robot: Walker) -> None:
        before = robot.pose
        step = self._next(robot)
        met = next((o for o in self.hidden if o["region"] == step.region != before.region), None)
        if met is not None and robot.name in met["blocks"]:
            self._line(
                "violation",
                robot=robot.name,
                at=before.region,
                proposed=step.region,
                obstacle=met["name"],
                action=met["action"],
            )
            self._line("backtrack", robot=robot.name, to=before.region)
            step, robot.plan = before, []
        else:
            met = None
        robot.pose = step
        heading = step.heading.label if step.heading is not None else None
        self._line(
            "move",
            robot=robot.name,
            **{"from": before.region, "to": step.region, "heading": heading},
        )
        for obstacle in list(self.hidden):
            capable = obstacle["action"] in robot.capabilities
            if capable and step.region in obstacle["resolution_regions"]:
                self._resolve(robot, obstacle)
        self._goal(robot)
        if met is not None:
            self._request(robot, met)

    def _resolve(self, robot: Walker, obstacle: dict[str, Any]) -> None:
        self.hidden.remove(obstacle)
        requested = any(f["obstacle"] == obstacle["name"] for f in self.stack)
        traversable = obstacle.get("traversable")
        self._line(
            "resolved",
            obstacle=obstacle["name"],
            robot=robot.name,
            at=robot.pose.region,
            requested=requested,
            traversable=traversable,
        )
        if traversable is False:
            for name in obstacle["blocks"]:
                self.known.setdefault(name, set()).add(obstacle["region"])
            self._line(
                "blocked",
                obstacle=obstacle["name"],
                robots=obstacle["blocks"],
                reason="untraversable",
            )
        for frame in self.stack:
            if frame["obstacle"] == obstacle["name"]:
                frame["done"] = True
        while self.stack and self.stack[-1].get("done"):
            frame = self.stack.pop()
            self._line(
                "pop",
                depth=len(self.stack),
                objectives=frame["before"],
                obstacle=frame["obstacle"],
                requester=frame["requester"],
                helper=frame["helper"],
            )
            for walker in self.team:
                if walker.objective != frame["before"][walker.name]:
                    walker.assign(frame["before"][walker.name])
                    self._synthesis(walker, "resolved")

    def _goal(self, robot: Walker) -> None:
        if robot.pose.region not in robot.targets[robot.next]:
            return
        index = robot.next
        robot.next = (index + 1) % len(robot.targets)
        robot.rounds += robot.next == 0
        self._line(
            "goal", robot=robot.name, goal=index, region=robot.pose.region, round=robot.rounds
        )

    def _request(self, robot: Walker, obstacle: dict[str, Any]) -> None:
        bids = {
            r.name: len(self._path(r, set(obstacle["resolution_regions"])))
            for r in self.team
            if obstacle["action"] in r.capabilities
        }
        helper = min(bids, key=lambda name: bids[name])
        self._line(
            "request",
            obstacle=obstacle["name"],
            requester=robot.name,
            bids=bids,
            helper=helper,
            regions=obstacle["resolution_regions"],
        )
        before = {r.name: r.objective for r in self.team}
        regions = obstacle["resolution_regions"]
        target = regions[0] if len(regions) == 1 else regions
        for walker in self.team:
            if walker.name == helper:
                first = next(iter(walker.objective.values()))
                first = first[0] if isinstance(first, list) else first
                walker.assign({"visit": [target, first]})
            elif walker is robot:
                walker.assign({"hold": robot.pose.region})
        frame = {"obstacle": obstacle["name"], "requester": robot.name, "helper": helper}
        self.stack.append({**frame, "before": before})
        self._line(
            "push",
            depth=len(self.stack),
            objectives={r.name: r.objective for r in self.team},
            **frame,
        )
        self._synthesis(robot, "request")
        self._synthesis(next(r for r in self.team if r.name == helper), "request")


def door() -> list[dict[str, Any]]:
    """Case study 1: the quadcopter meets a door, Digit opens it."""
    team = [
        Walker("quad", "quadcopter", Pose(14), {"patrol": [54, 49]}),
        Walker("digit", "digit", Pose(71, Heading.EAST), {"patrol": [58, 28]}),
    ]
    world = RegionMap.from_grid(DOOR_MAP.splitlines())
    return Simulator("opening a door", world, team, [{"type": "door", "region": 47}]).run()


def chain() -> list[dict[str, Any]]:
    """Case study 3: a request while another is open, stack depth 2."""
    team = [
        Walker("quad", "quadcopter", Pose(49), {"patrol": [22, 76]}),
        Walker("digit", "digit", Pose(58, Heading.EAST), {"visit": [41, 45]}),
    ]
    hidden = [
        {"type": "uncertainty", "region": 43, "traversable": True},
        {"type": "door", "region": 47},
    ]
    world = RegionMap.from_grid(CHAIN_MAP.splitlines())
    return Simulator("a chain of conflicts", world, team, hidden).run()


def detour() -> list[dict[str, Any]]:
    """An uncertainty that turns out untraversable: its region is closed to Digit."""
    team = [
        Walker("quad", "quadcopter", Pose(14), {"patrol": [28, 58]}),
        Walker("digit", "digit", Pose(29, Heading.EAST), {"visit": [28, 36]}),
    ]
    hidden = [{"type": "uncertainty", "region": 34, "traversable": False}]
    grid = DOOR_MAP.splitlines()
    grid[2] = grid[4] = "#...........#"
    return Simulator("scouting", RegionMap.from_grid(grid), team, hidden).run()


def crowd(robots: int = 6, ticks: int = 1000, seed: int = 1) -> list[dict[str, Any]]:
    """A long run of many robots on a large map: what size and speed are measured on."""
    chance = random.Random(seed)
    rows, cols = 20, 32
    grid = [
        "".join(
            "#" if r in (0, rows - 1) or c in (0, cols - 1) or (c % 6 == 4 and r % 5 != 2) else "."
            for c in range(cols)
        )
        for r in range(rows)
    ]
    world = RegionMap.from_grid(grid)
    free = chance.sample(world.free, 3 * robots + 8)
    team = []
    for i in range(robots):
        start, a, b = (free.pop() for _ in range(3))
        model = ("digit", "quadcopter")[i % 2]
        heading = Heading.EAST if model == "digit" else None
        team.append(Walker(f"{model}{i}", model, Pose(start, heading), {"visit": [a, b]}))
    hidden = [
        {"type": ("door", "uncertainty")[i % 2], "region": free.pop(), "traversable": None}
        for i in range(8)
    ]
    return Simulator("a crowd", world, team, hidden, rounds=10**6).run(ticks)


def write(lines: list[dict[str, Any]], path: Path) -> Path:
    """The lines as a trace file."""
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return path
