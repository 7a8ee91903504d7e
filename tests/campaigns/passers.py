"""Traces in which one robot passes an obstacle that stands, and which are right otherwise.

``excursions`` gives one robot a joint plan of its own: it goes into the obstacle and back to where
it was, while the others stay; all later lines are as many ticks later. ``declared`` leaves all
moves, and says in the header that an obstacle blocks the robot which goes through it.
"""

import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from random import Random
from typing import Any

from campaigns.judge.mission import HEADINGS, Mission, Pose, read_mission
from campaigns.judge.replay import Replay
from campaigns.judge.situation import Stage

MOST = 3
LONGEST = 6

Line = dict[str, Any]


@dataclass(frozen=True)
class Passer:
    """A changed trace, and the robot that passes the obstacle in it."""

    lines: list[Line]
    robot: str
    obstacle: str


@dataclass(frozen=True)
class _Moment:
    """Before a line: where robots stand, whether all do and none is in a plan, and the obstacles
    that stand and were not given up, with their stages."""

    poses: Mapping[str, Pose]
    resting: bool
    standing: Mapping[str, Stage]


def _moments(mission: Mission, lines: Sequence[Line]) -> Iterator[_Moment]:
    now, planned = Replay(mission), False
    for line in lines:
        if line["type"].startswith("plan"):
            planned = line["type"] == "plan"
        standing = {k: stage for k, stage in now.standing.items() if k not in now.given_up}
        resting = not planned and set(now.toward.values()) == {None}
        yield _Moment({name: now.pose(name) for name in now.robots}, resting, standing)
        now.follow(line)


def excursions(data: Mapping[str, Any], lines: Sequence[Line], random: Random) -> Iterator[Passer]:
    """A few at most for each robot and each obstacle, at moments that are drawn."""
    mission = read_mission(data)
    moments = list(_moments(mission, lines))
    found: dict[tuple[str, str], list[tuple[int, list[Pose]]]] = {}
    for k in range(1, len(lines)):
        first = lines[k]["tick"] > lines[k - 1].get("tick", 0) > 0
        poses, standing = moments[k].poses, moments[k].standing
        passing = any(line["type"] in ("appeared", "gone") for line in lines[k:])
        resting = moments[k].resting and not _acts_next(mission, poses, standing)
        for robot in poses if first and resting and not passing else ():
            rivals = lines[0]["scenario"]["robots"][robot]["conflicts"]
            taken = {poses[other][0] for other in rivals}
            for obstacle in standing:
                way = _excursion(mission, robot, poses[robot], standing, obstacle, taken)
                if way:
                    found.setdefault((robot, obstacle), []).append((k, way))
    for (robot, obstacle), ways in found.items():
        for k, way in random.sample(ways, min(MOST, len(ways))):
            yield Passer(_inserted(lines, k, robot, way, moments[k].poses), robot, obstacle)


def declared(data: Mapping[str, Any], lines: Sequence[Line]) -> Iterator[Passer]:
    """One for each robot that goes through a standing obstacle which does not block it."""
    mission, seen = read_mission(data), set[tuple[str, str]]()
    robots = {robot.name: robot for robot in mission.robots}
    for line, now in zip(lines, _moments(mission, lines), strict=True):
        for name, stage in now.standing.items() if line["type"] == "move" else ():
            one, robot = mission.obstacles[name], line["robot"]
            if line["to"] != one.region or robot in one.blocks or (robot, name) in seen:
                continue
            if mission.blocked(robots[robot], replace(one, blocks=one.blocks | {robot}), stage[0]):
                seen.add((robot, name))
                changed = copy.deepcopy(list(lines))
                order = changed[0]["scenario"]["robots"]
                for entry in changed[0]["scenario"]["obstacles"]:
                    if entry["name"] == name:
                        entry["blocks"] = [r for r in order if r in {*entry["blocks"], robot}]
                yield Passer(changed, robot, name)


def _acts_next(mission: Mission, poses: Mapping[str, Pose], standing: Mapping[str, Stage]) -> bool:
    """Whether a robot stands where it fulfils the next need of an obstacle in its next turn."""
    due = [mission.obstacles[name].needs[index] for name, (index, _) in standing.items()]
    return any(
        need.action in robot.capabilities and poses[robot.name][0] in need.at
        for need in due
        for robot in mission.robots
    )


def _excursion(
    mission: Mission,
    name: str,
    begin: Pose,
    standing: Mapping[str, Stage],
    through: str,
    taken: set[int],
) -> list[Pose] | None:
    """A shortest path through an obstacle and back, on which the robot acts nowhere else."""
    (robot,) = (one for one in mission.robots if one.name == name)
    region = mission.obstacles[through].region
    if not mission.blocked(robot, mission.obstacles[through], standing[through][0]):
        return None
    if region in taken:
        return None
    bad = set(taken)
    for obstacle, (index, _) in standing.items():
        one = mission.obstacles[obstacle]
        bad |= {one.region} if mission.blocked(robot, one, index) else set()
        bad |= {r for n in one.needs[index:] if n.action in robot.capabilities for r in n.at}
    level: dict[tuple[Pose, bool], list[Pose]] = {(begin, False): [begin]}
    for _ in range(LONGEST):
        after: dict[tuple[Pose, bool], list[Pose]] = {}
        for (pose, passed), way in level.items():
            for new in mission.steps(robot, pose):
                if new[0] not in bad - {region, begin[0]}:
                    after.setdefault((new, passed or new[0] == region), [*way, new])
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
