"""The team at a line of the trace, and what follows from it: reachable poses and duties."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from itertools import product

from safenav.audit.grid import opposite
from safenav.audit.progress import ENDS
from safenav.audit.proofs.formulas import Formulas, UnreadError, read_formulas, rules_of
from safenav.audit.situation import Situation, Status
from safenav.audit.team import Member, Need, OpenObstacle, Pose, Poses, Team
from safenav.trace.objective import Objective
from safenav.trace.vocabulary import Region

NEWEST = "newest"
HEADINGS = ("north", "east", "south", "west")


def pose_of(name: str, now: Situation) -> Pose:
    """Return the robot's pose; for a robot in transit, the pose where it will arrive."""
    toward = now.toward[name]
    if toward is None:
        return now.region[name], now.heading[name] if now.has_heading(name) else None
    way = now.grid.direction(now.region[name], toward)
    return toward, way if now.has_heading(name) else None


def open_obstacles(
    now: Situation, refused: Collection[tuple[str, str]] = ()
) -> tuple[OpenObstacle, ...]:
    """The obstacles with an open request in the order in which they are served. ``refused``:
    robots that have no strategy for serving an obstacle."""
    return tuple(
        OpenObstacle(
            name,
            now.obstacles[name].region,
            frozenset(now.stopped_by(name)),
            tuple(
                Need(
                    frozenset(
                        n
                        for n, r in now.header.robots.items()
                        if now.obstacles[name].actions(number) <= r.capabilities
                        and (number > now.stage[name] or not need.same or n in now.group[name])
                    ),
                    frozenset(need.regions),
                    need.robots,
                    need.together,
                    bool(need.same),
                )
                for number, need in enumerate(now.obstacles[name].all_needs)
                if number >= now.stage[name]
            ),
            frozenset() if now.need(name).together else frozenset(now.done[name]),
            frozenset(robot for robot, obstacle in refused if obstacle == name),
        )
        for name in _in_order(now)
    )


def _in_order(now: Situation) -> list[str]:
    """The obstacles with an open request, the one that is served first before the others."""
    return [*now.requests][:: -1 if now.header.order == NEWEST else 1]


def team_of(now: Situation) -> Team | None:
    """The robots with their objectives; None if some have formulas that are not read here."""
    try:
        members = {name: _member(name, now) for name in now.header.robots}
        return Team(members, newest_first=now.header.order == NEWEST)
    except UnreadError:
        return None


def _member(name: str, now: Situation) -> Member:
    robot = now.header.robots[name]
    timing = robot.timing.most if robot.timing is not None else 1
    rivals = frozenset(n for n in now.header.robots if n != name and now.conflict(name, n))
    if name in now.out:
        here = pose_of(name, now)
        return Member({here: ()}, (frozenset([here]),), rivals, timing)
    free = [r for r in range(now.grid.rows * now.grid.cols) if now.grid.is_free(r)]
    poses: list[Pose] = list(product(free, HEADINGS if now.has_heading(name) else (None,)))
    steps = {pose: tuple(_steps(pose, now)) for pose in poses}
    targets = robot.objective.targets[-1 if robot.objective.kind in ENDS else 0 :]
    aims = tuple(frozenset(p for p in poses if p[0] in target) for target in targets)
    if robot.objective.kind == "ltl":
        formulas = read_formulas(json.loads(robot.objective.body))
        steps = {a: tuple(b for b in to if formulas.allows(a, b)) for a, to in steps.items()}
        aims = tuple(_met(formulas, k, steps) for k in range(len(formulas.liveness)))
    stays = (Status.UNTRAVERSABLE, Status.GIVEN_UP)
    if robot.objective.always:
        formulas = rules_of(robot.objective)
        steps = {a: tuple(b for b in to if formulas.allows(a, b)) for a, to in steps.items()}
    sealed = robot.objective.avoid | {
        o.region
        for o in now.obstacles.values()
        if now.status[o.name] in stays and name in now.stopped_by(o.name)
    }
    steps = {a: tuple(b for b in to if b[0] not in sealed) for a, to in steps.items()}
    here = pose_of(name, now)
    kept = {a: to for a, to in steps.items() if a[0] not in sealed or a == here}
    return Member(kept, aims, rivals, timing)


def _steps(pose: Pose, now: Situation) -> list[Pose]:
    region, faced = pose
    found: list[Pose] = []
    for to in now.grid.neighbours(region):
        way = now.grid.direction(region, to)
        if faced is None:
            found.append((to, None))
        elif way is not None and opposite(way) != faced:
            found.append((to, way))
    return found


def _met(formulas: Formulas, goal: int, steps: Mapping[Pose, tuple[Pose, ...]]) -> Poses:
    """Where a goal may be met: by staying, or by a step where staying at neither end would."""
    staying = {pose for pose in steps if formulas.meets(goal, pose, pose)}
    entered = {
        b
        for a, to in steps.items()
        for b in to
        if not {a, b} & staying and formulas.meets(goal, a, b)
    }
    return frozenset(staying | entered)


def can_alternate(name: str, objective: Objective, now: Situation) -> bool:
    """Return whether a robot can meet each target of an objective infinitely often now, by its
    moves alone."""
    member = _member(name, now)
    aims = tuple(
        frozenset(pose for pose in member.steps if pose[0] in target)
        for target in objective.targets
    )
    team = Team({name: member._replace(aims=aims)})
    return team.goes_on(name, frozenset([pose_of(name, now)]), open_obstacles(now))


def serving(now: Situation) -> dict[str, frozenset[str]]:
    """Return the robots that serve each requested obstacle, by the objectives in force."""
    found = {}
    for name in now.requests:
        regions = [frozenset(need.regions) for need in now.obstacles[name].all_needs]
        found[name] = frozenset(
            robot
            for robot in now.helping.get(name, ())
            if now.objectives[robot] != now.header.robots[robot].objective
            and _goes(now.objectives[robot].targets[:1], regions, now.objectives[robot].kind)
        )
    return found


def _goes(
    first: tuple[frozenset[Region], ...], regions: list[frozenset[Region]], kind: str
) -> bool:
    return kind == "ltl" or any(target <= where for target in first for where in regions)
