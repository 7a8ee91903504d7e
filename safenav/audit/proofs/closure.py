"""Closure tables: a set of poses for each robot that it cannot leave, whatever is resolved.

Accepted if each robot begins inside its set, no step leads out of it, every obstacle that the proof
lists as never resolved has a need for which too few robots reach the regions where it is met, and
some robot cannot continue forever in its set. By induction over the steps no robot ever leaves its
set, and no obstacle listed as never resolved is resolved. Collisions are ignored: they only remove
moves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from safenav.audit.proofs.moment import Moment, OpenObstacle, Pose, Robot
from safenav.audit.proofs.reading import MalformedError, mapping, names, poses

Sets = Mapping[str, frozenset[Pose]]


def closure_problems(
    proof: Mapping[str, object], moment: Moment, lame: bool, start: Sets | None = None
) -> Iterator[str]:
    """Yield why a closure table does not hold. ``lame``: some robot must be unable to continue in
    it. ``start``: where each robot may be (default: where it is)."""
    never = [name for name in names(proof.get("never"), "never") if name not in moment.shut]
    away = names(proof.get("resolved"), "resolved")
    tables = {
        name: mapping(table, f"the table of {name}")
        for name, table in mapping(proof.get("robots"), "robots").items()
    }
    unknown = [name for name in never if name not in moment.obstacles]
    if unknown:
        yield f"{', '.join(unknown)} is unknown or already resolved, so it blocks no robot"
        return
    forgotten = sorted(moment.obstacles.keys() - {*never, *away})
    if forgotten:
        yield f"the closure omits {', '.join(forgotten)}"
        return
    if tables.keys() != moment.robots.keys():
        yield f"the closure covers {', '.join(sorted(tables)) or 'nobody'}, not of the whole team"
        return
    inside = {name: poses(table.get("poses"), f"{name}'s poses") for name, table in tables.items()}
    begins = start or {name: frozenset([r.pose]) for name, r in moment.robots.items()}
    stuck: dict[str, int] = {}
    for name in never:
        stages = list(_stuck_at(moment.obstacles[name], moment, inside))
        if not stages:
            yield f"{name} can be resolved: enough robots reach its resolution regions"
            return
        # The earlier it is stuck, the more it closes; any stage that the sets agree with will do.
        stuck[name] = stages[0]
    for name, robot in moment.robots.items():
        walls = moment.sealed[name] | {
            moment.obstacles[one].region
            for one in never
            if moment.obstacles[one].closes(robot, stuck[one])
        }
        yield from _robot_problems(robot, moment, inside[name], begins[name], walls, tables[name])
    if lame and all(_is_live(tables[name]) for name in tables):
        yield "the proof marks every robot as live, so it proves nothing"


def _stuck_at(obstacle: OpenObstacle, moment: Moment, inside: Sets) -> Iterator[int]:
    """Yield the stages at which too few robots can reach the regions where the need is met."""
    for stage in range(obstacle.stage, len(obstacle.needs)):
        need, begin = obstacle.needs[stage], stage
        while begin > obstacle.stage and obstacle.needs[begin].same:
            begin -= 1  # the same robots must have met it, so they got there, too
        regions = {name: {region for region, _ in poses} for name, poses in inside.items()}
        able = {
            name: frozenset(regions[name])
            for name, robot in moment.robots.items()
            if obstacle.able(robot, stage)
            and (begin > obstacle.stage or not obstacle.needs[begin].same or name in obstacle.group)
            and not (stage == obstacle.stage and not need.together and name in obstacle.done)
            and all(
                regions[name] & obstacle.needs[k].regions
                or (k == obstacle.stage and name in obstacle.done)
                for k in range(begin, stage)
            )
        }
        if not moment.enough(need, obstacle.missing(stage), able):
            yield stage


def _robot_problems(
    robot: Robot,
    moment: Moment,
    inside: frozenset[Pose],
    begins: frozenset[Pose],
    walls: frozenset[int],
    table: Mapping[str, object],
) -> Iterator[str]:
    outside = sorted(begins - inside, key=str)
    if outside:
        yield f"{robot.name} begins at {_told(outside[0])}, outside its closure"
        return
    if robot.judged:
        for pose in sorted(inside, key=str):
            for to in moment.steps(robot, pose):
                if to[0] not in walls and to not in inside:
                    yield f"{robot.name} gets from {_told(pose)} to {_told(to)}, out of its closure"
                    return
    if not _is_live(table) and robot.judged and moment.live(robot, inside, walls):
        yield f"{robot.name} can continue forever in its closure, but is marked not live"


def _is_live(table: Mapping[str, object]) -> bool:
    live = table.get("live")
    if not isinstance(live, bool):
        raise MalformedError("live must be true or false")
    return live


def _told(pose: Pose) -> str:
    region, heading = pose
    return f"{region}" if heading is None else f"{region} facing {heading}"
