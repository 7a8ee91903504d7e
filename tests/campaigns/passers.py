"""Traces in which one robot passes an obstacle that stands, and which are right otherwise.

``excursions`` gives one robot a joint plan of its own: it goes into the obstacle and back to where
it was, while the others stay; all later lines are as many ticks later. ``declared`` leaves all
moves, and says in the header that an obstacle blocks the robot which goes through it.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from random import Random
from typing import Any

from campaigns.oracle import HEADINGS, Pose, Stage, Walk

MOST = 3
LONGEST = 6

Line = dict[str, Any]


@dataclass(frozen=True)
class Passer:
    """A changed trace, and the robot that passes the obstacle in it."""

    lines: list[Line]
    robot: str
    obstacle: str


class _Watched(Walk):
    """Before each line: where robots stand, whether any is in transit or in a plan, and the
    obstacles that stand and were not given up, with their stages."""

    def _follow(self, line: Mapping[str, Any], obstacle: Any) -> None:
        if line["type"] == "header":
            self.before: list[tuple[dict[str, Pose], bool, dict[str, Stage]]] = []
            self.planned = False
        if line["type"].startswith("plan"):
            self.planned = line["type"] == "plan"
        poses = {name: self.pose(name) for name in self.at}
        resting = not self.planned and set(self.bound.values()) == {None}
        standing = {k: stage for k, stage in self.standing.items() if k not in self.shut}
        self.before.append((poses, resting, standing))
        super()._follow(line, obstacle)


def excursions(data: Mapping[str, Any], lines: Sequence[Line], random: Random) -> Iterator[Passer]:
    """A few at most for each robot and each obstacle, at moments that are drawn."""
    walk = _Watched(data, lines)
    found: dict[tuple[str, str], list[tuple[int, list[Pose]]]] = {}
    for k in range(1, len(lines)):
        first = lines[k]["tick"] > lines[k - 1].get("tick", 0) > 0
        poses, resting, standing = walk.before[k]
        passing = any(line["type"] in ("appeared", "gone") for line in lines[k:])
        for robot in poses if first and resting and not passing else ():
            rivals = lines[0]["scenario"]["robots"][robot]["conflicts"]
            taken = {poses[other][0] for other in rivals}
            for obstacle in standing:
                way = _excursion(walk, robot, poses[robot], standing, obstacle, taken)
                if way:
                    found.setdefault((robot, obstacle), []).append((k, way))
    for (robot, obstacle), ways in found.items():
        for k, way in random.sample(ways, min(MOST, len(ways))):
            poses = walk.before[k][0]
            yield Passer(_inserted(lines, k, robot, way, poses), robot, obstacle)


def declared(data: Mapping[str, Any], lines: Sequence[Line]) -> Iterator[Passer]:
    """One for each robot that goes through a standing obstacle which does not block it."""
    walk = _Watched(data, lines)
    seen = set()
    for line, (_, _, standing) in zip(lines, walk.before, strict=True):
        for name, stage in standing.items() if line["type"] == "move" else ():
            one, robot = walk.lab.obstacles[name], line["robot"]
            if line["to"] != one.region or robot in one.blocks or (robot, name) in seen:
                continue
            walk.lab.obstacles[name] = replace(one, blocks=one.blocks | {robot})
            if walk.lab.keeps_out(name, stage, robot):
                seen.add((robot, name))
                changed = copy.deepcopy(list(lines))
                order = changed[0]["scenario"]["robots"]
                for entry in changed[0]["scenario"]["obstacles"]:
                    if entry["name"] == name:
                        entry["blocks"] = [r for r in order if r in {*entry["blocks"], robot}]
                yield Passer(changed, robot, name)
            walk.lab.obstacles[name] = one


def _excursion(
    walk: Walk,
    robot: str,
    begin: Pose,
    standing: Mapping[str, Stage],
    through: str,
    taken: set[int],
) -> list[Pose] | None:
    """A shortest way from a pose through an obstacle and back, on which the robot acts nowhere
    else."""
    lab = walk.lab
    if not lab.keeps_out(through, standing[through], robot):
        return None
    region = lab.obstacles[through].region
    if region in taken:
        return None
    bad = set(taken)
    for name, (index, done) in standing.items():
        one = lab.obstacles[name]
        bad |= {one.region} if lab.keeps_out(name, (index, done), robot) else set()
        bad |= {r for n in one.needs[index:] if n.action in lab.can[robot] for r in n.at}
    turns = lab.model[robot]["mobility"] == "heading"
    level: dict[tuple[Pose, bool], list[Pose]] = {(begin, False): [begin]}
    for _ in range(LONGEST):
        after: dict[tuple[Pose, bool], list[Pose]] = {}
        for (pose, passed), way in level.items():
            for side, to in enumerate(lab.beside(pose[0])):
                if to is None or (turns and side == (pose[1] + 2) % 4):
                    continue
                if to in bad - {region, begin[0]}:
                    continue
                new = (to, side if turns else -1)
                after.setdefault((new, passed or to == region), [*way, new])
        level = after
        if (begin, True) in level:
            return level[begin, True]
    return None


def _inserted(
    lines: Sequence[Line], at: int, robot: str, way: list[Pose], poses: Mapping[str, Pose]
) -> list[Line]:
    """With the excursion before line ``at``."""

    def heading(pose: Pose) -> str | None:
        return None if pose[1] < 0 else HEADINGS[pose[1]]

    tick = lines[at - 1]["tick"]
    places = [[pose[0], heading(pose)] for pose in way]
    new: list[Line] = [
        {"type": "plan", "tick": tick, "reason": "", "robots": {robot: places}, "orders": []}
    ]
    for k, (before, after) in enumerate(pairwise(way), tick + 1):
        for name, rest in poses.items():
            one, two = (before, after) if name == robot else (rest, rest)
            move = {"type": "move", "tick": k, "robot": name, "from": one[0], "to": two[0]}
            by = "plan" if name == robot else "stay"
            new.append({**move, "heading": heading(two), "by": by})
    new.append({"type": "plan_end", "tick": tick + len(way) - 1, "reason": "reached"})
    changed = copy.deepcopy(list(lines))
    for line in changed[at:]:
        line["tick"] += len(way) - 1
        if line["type"] == "outcome":
            line["ticks"] += len(way) - 1
    return [*changed[:at], *new, *changed[at:]]
