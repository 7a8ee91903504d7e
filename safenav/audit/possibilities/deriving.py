"""The team at a line of the trace, and its derived data: reachable poses and duties."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from itertools import product
from math import inf

from safenav.audit.formulas import Formulas, rules_of
from safenav.audit.kinds import shape_of
from safenav.audit.language import HEADINGS, Pose, RefusedError
from safenav.audit.lines import Objective
from safenav.audit.needs import OpenObstacle
from safenav.audit.poses import PoseGraph, Poses
from safenav.audit.possibilities.members import Member
from safenav.audit.possibilities.team import Team
from safenav.audit.run.situation import Situation


def open_obstacles(
    now: Situation, refused: Collection[tuple[str, str]] = ()
) -> tuple[OpenObstacle, ...]:
    """Return the obstacles with an open request in the order in which they are served. ``refused``:
    robots that have no strategy for serving an obstacle, besides those that leave it to others."""
    names = [*now.requests][::-1]
    names.sort(key=lambda name: now.dues.get(name, inf))
    return tuple(open_obstacle(name, now, refused) for name in names)


def open_obstacle(
    name: str,
    now: Situation,
    refused: Collection[tuple[str, str]] = (),
    out: Collection[str] | None = None,
) -> OpenObstacle:
    """Return one obstacle with its unmet needs. ``out``: the robots out of service (default: the
    present ones); in a live run they do not act."""
    one = now.open[name]
    barred = frozenset(robot for robot, left in {*refused, *now.barred} if left == name)
    failed = frozenset(robot for robot, left in now.barred if left == name)
    if now.live:
        barred |= {*(now.out if out is None else out)}
    done = frozenset[str]() if one.left[0].together else one.done
    return one._replace(left=now.unmet(one), done=done, barred=barred, failed=failed)


def team_of(now: Situation, out: Collection[str] | None = None) -> Team | None:
    """Return the robots with their objectives; None if this check cannot read some robot's
    formulas. ``out``: the robots out of service (default: the present ones)."""
    stays, away = permanent(now), now.out if out is None else out
    try:
        members = {name: member_of(name, now, stays, away) for name in now.header.robots}
        return Team(members)
    except RefusedError:
        return None


def permanent(now: Situation) -> set[str]:
    """Return the permanent obstacles: no robot can resolve them, or they are untraversable."""
    return {name for name, status in now.status.items() if status.stays}


def poses_in(regions: Iterable[int], name: str, now: Situation) -> Iterator[Pose]:
    """Yield a robot's poses in some regions."""
    yield from product(regions, HEADINGS if now.has_heading(name) else (None,))


def member_of(name: str, now: Situation, stays: Collection[str], out: Collection[str]) -> Member:
    robot, own = now.header.robots[name], now.own[name]
    timing = robot.timing or 1
    rivals = frozenset(now.rivals[name])
    here = now.pose(name)
    laden = any(name in now.carriers(one) for one in stays)
    if name in out:
        return Member(PoseGraph({here: ()}), (frozenset([here]),), rivals, timing, laden)
    steps = now.grid.graph(robot.mobility)
    targets = own.targets[-1 if shape_of(own.kind).ends else 0 :]
    aims = tuple(frozenset(p for p in steps if p[0] in target) for target in targets)
    if own.kind == "ltl" or own.always:
        formulas = rules_of(own)
        steps = PoseGraph(
            (a, tuple(b for b in to if formulas.allows(a, b))) for a, to in steps.items()
        )
        if own.kind == "ltl":
            aims = tuple(_met(formulas, k, steps) for k in range(len(formulas.goals)))
    sealed = own.avoid | {now.obstacles[one].region for one in stays if name in now.stopped_by(one)}
    if sealed:
        inside = any(now.is_inside(name, one) for one in stays)
        ahead = {b for b in steps.get(here, ()) if inside and b[0] != now.came[name]}
        steps = PoseGraph(
            (a, tuple(b for b in to if b[0] not in sealed and not (a == here and b in ahead)))
            for a, to in steps.items()
            if a[0] not in sealed or a == here
        )
    return Member(steps, aims, rivals, timing, laden)


def _met(formulas: Formulas, goal: int, steps: Mapping[Pose, tuple[Pose, ...]]) -> Poses:
    """Return the poses that meet a goal by staying, and the ends of the steps that meet it although
    staying at either end would not."""
    staying = {pose for pose in steps if formulas.meets(goal, pose, pose)}
    entered = {
        b
        for a, to in steps.items()
        for b in to
        if not {a, b} & staying and formulas.meets(goal, a, b)
    }
    return frozenset(staying | entered)


def can_alternate(name: str, objective: Objective, now: Situation) -> bool:
    """Return whether a robot can now meet each of its targets infinitely often without help."""
    member = member_of(name, now, permanent(now), now.out)
    aims = tuple(
        frozenset(pose for pose in member.steps if pose[0] in target)
        for target in objective.targets
    )
    team = Team({name: member._replace(aims=aims)})
    return team.can_continue(name, frozenset([now.pose(name)]), open_obstacles(now))


def serving(now: Situation, *, own: bool = False, exact: bool = False) -> dict[str, frozenset[str]]:
    """Return the robots that serve each requested obstacle, by the objectives in force. If several
    obstacles have the same regions, a robot serves the one for which it was last named. ``own``:
    also count robots whose own objective equals the duty, which the objectives cannot show.
    ``exact``: count only robots whose target is all regions of a need; the others may serve another
    obstacle."""
    found = dict[str, frozenset[str]]()
    for name in now.requests:
        needs = now.obstacles[name].all_needs[: now.open[name].stage + 1]
        regions = [frozenset(need.regions) for need in needs]
        found[name] = frozenset(
            robot
            for robot in now.helping.get(name, frozenset()) - now.resting
            if (own or now.objectives[robot] != now.own[robot])
            and (not exact or {*now.objectives[robot].targets[:1]} & {*regions})
            and (
                _goes(now.objectives[robot].targets[:1], regions, now.objectives[robot].kind)
                or is_stop(robot, now.objectives[robot].targets, now)
                or (
                    now.objectives[robot] == now.own[robot]
                    and any(meets_own_first(robot, name, places, now) for places in regions)
                )
            )
        )
    for robot, name in now.named.items():
        if robot in found.get(name, ()) or name not in found:  # resolved in this turn
            found = {one: who if one == name else who - {robot} for one, who in found.items()}
    return found


def meets_own_first(robot: str, name: str, regions: AbstractSet[int], now: Situation) -> bool:
    """Return whether a robot meets the next target of its ``once`` before it serves an obstacle in
    ``regions``: it cannot turn on the spot, and could not meet all remaining targets afterwards."""
    team, own = team_of(now), now.own[robot]
    if team is None or not (shape_of(own.kind).ends and now.has_heading(robot)):
        return False
    after = tuple(one for one in open_obstacles(now) if one.name != name)
    here = team.reach(robot, frozenset([now.pose(robot)]), open_obstacles(now))
    rest = frozenset(pose for pose in here if pose[0] in regions)
    for target in own.targets[now.progress[robot].ahead :]:
        rest = frozenset(p for p in team.reach(robot, rest, after) if p[0] in target)
    return not rest


def is_stop(robot: str, targets: Sequence[AbstractSet[int]], now: Situation) -> bool:
    """Return whether a robot with a battery has a charger as its next target, or a target of its
    own, where it may turn. A robot with a heading may be anywhere on the way: it keeps its stop."""
    header, waiting = now.header.robots[robot], now.header.robots[robot].while_waiting
    if header.battery is None or len(targets) != 1:
        return False
    if (*targets,) == now.stop.get(robot):
        return True
    if any({requesters.get(robot)} == targets[0] for requesters in now.requests.values()):
        return False  # it waits there for help
    own = (*now.own[robot].targets, *(waiting.targets if waiting else ()))
    if now.toward[robot] is not None:  # a target that it had when it departed
        own = (*own, frozenset({now.toward[robot]}))
    return any(targets[0] <= stop for stop in ({*(now.header.chargers or ())}, *own))


def _goes(first: tuple[frozenset[int], ...], regions: list[frozenset[int]], kind: str) -> bool:
    return kind == "ltl" or any(target <= where for target in first for where in regions)
