"""Closure tables: for each robot a set of poses that it cannot leave, whatever is resolved.

A table is accepted if each robot begins inside its set, no step leads out of it, every obstacle
listed as never resolved has a need whose regions too few robots reach, and some robot cannot
continue forever in its set. By induction over the steps no robot ever leaves its set, and no
obstacle listed as never resolved is resolved. Collisions are ignored: they only remove moves.

Trees prove cases with irreversible choices: every possible choice, with a proof after each. A
choice is the next need of an obstacle and a group of robots that meets it. A lossless choice, after
which each robot of the group can return to every pose that it could reach before, stands for all
others.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

from safenav.audit.language import Pose
from safenav.audit.needs import OpenObstacle, OpenObstacles
from safenav.audit.poses import Poses
from safenav.audit.possibilities.team import TooManyError
from safenav.audit.proofs.case import Case

Sets = Mapping[str, Poses]


def closure_problems(
    proof: Mapping[str, Any], case: Case, lame: bool, start: Sets | None = None
) -> Iterator[str]:
    """Yield the errors of a closure table. ``lame``: some robot must be unable to continue in it.
    ``start``: the possible poses of each robot (default: its present pose)."""
    never = [name for name in proof["never"] if name not in case.shut]
    away, tables = proof["resolved"], proof["robots"]
    known = {obstacle.name: obstacle for obstacle in case.obstacles}
    unknown = [name for name in never if name not in known]
    if unknown:
        yield f"{', '.join(unknown)} is unknown or already resolved, so it blocks no robot"
        return
    forgotten = sorted(known.keys() - {*never, *away})
    if forgotten:
        yield f"the closure omits {', '.join(forgotten)}"
        return
    if tables.keys() != case.at.keys():
        yield f"the closure covers {', '.join(sorted(tables)) or 'no robot'}, not the whole team"
        return
    inside = {
        name: frozenset((region, heading) for region, heading in table["poses"])
        for name, table in tables.items()
    }
    stuck = list[OpenObstacle]()
    carried = [known[name] for name in never]
    while True:  # loads whose next need is never met are carried forever
        full = case.team.full(carried)
        kept = [one for one in carried if next(_stuck_at(one, case, inside, full), None) == 0]
        if kept == carried:
            break
        carried = kept
    for name in never:
        # The earlier it is stuck, the more it closes; any stage consistent with the sets suffices.
        stage = next(_stuck_at(known[name], case, inside, full), None)
        if stage is None:
            yield f"{name} can be resolved: enough robots reach its resolution regions"
            return
        stuck.append(known[name]._replace(left=known[name].left[stage:]))
    for name, pose in case.at.items():
        begins = frozenset([pose]) if start is None else start[name]
        yield from _robot_problems(name, case, inside[name], begins, (*stuck,), tables[name])
    if lame and all(table["live"] for table in tables.values()):
        yield "the proof marks every robot as live, so it proves nothing"


def _stuck_at(
    obstacle: OpenObstacle, case: Case, inside: Sets, full: frozenset[str]
) -> Iterator[int]:
    """Yield the indices of open needs whose regions too few robots can reach. ``full``: robots that
    can never take another load."""
    left, regions = obstacle.left, {n: {at for at, _ in there} for n, there in inside.items()}
    for number, need in enumerate(left):
        begin = number
        while begin and left[begin].same:
            begin -= 1  # the same robots met it, so they reach its regions too
        able = {
            name: inside[name]
            for name in frozenset.intersection(*(one.able for one in left[begin : number + 1]))
            if name not in obstacle.barred
            and not (number == 0 and name in full and obstacle.takes())
            and not (number == 0 and name in obstacle.done)
            and not (name in left[begin].cut_off and not (begin == 0 and name in obstacle.done))
            and regions[name] & need.regions
            and all(
                regions[name] & left[k].regions or (k == 0 and name in obstacle.done)
                for k in range(begin, number)
            )
        }
        missing = need.robots - (len(obstacle.done) if number == 0 else 0)
        at = {n: frozenset(p for p in able[n] if p[0] in need.regions) for n in sorted(able)}
        groups = combinations(at, missing)
        if len(at) < missing or (
            need.together and not any(case.team.fits(group, at) for group in groups)
        ):
            yield number


def _robot_problems(
    name: str,
    case: Case,
    inside: Poses,
    begins: Poses,
    stuck: OpenObstacles,
    table: Mapping[str, Any],
) -> Iterator[str]:
    outside = sorted(begins - inside, key=str)
    if outside:
        yield f"{name} begins at {_shown(outside[0])}, outside its closure"
        return
    walls, steps = case.team.walls(name, stuck), case.team.members[name].steps
    for pose in sorted(inside, key=str):
        for to in steps.get(pose, ()):
            if to[0] not in walls and to not in inside:
                yield f"{name} can move from {_shown(pose)} to {_shown(to)}, outside its closure"
                return
    if not table["live"] and case.team.can_continue(name, inside, stuck):
        yield f"{name} can continue forever in its closure, but is marked not live"


def _shown(pose: Pose) -> str:
    region, heading = pose
    return f"{region}" if heading is None else f"{region} facing {heading}"


MOST_NODES = 10_000
MOST_DEPTH = 60

Choice = tuple[str, int, frozenset[str]]
"""An obstacle, the number of its need, and the robots that fulfil it."""


@dataclass
class _Budget:
    nodes: int = MOST_NODES


def tree_problems(proof: Mapping[str, Any], case: Case) -> Iterator[str]:
    """Yield the errors of a tree. Raises TooManyError."""
    sets = {name: frozenset([pose]) for name, pose in case.at.items()}
    yield from _problems(proof, case, sets, _Budget(), 0)


def _problems(
    proof: Mapping[str, Any], case: Case, sets: Sets, budget: _Budget, depth: int
) -> Iterator[str]:
    budget.nodes -= 1
    if budget.nodes < 0 or depth > MOST_DEPTH:
        limit = f"the tree has more than {MOST_NODES} nodes or is deeper than {MOST_DEPTH}"
        raise TooManyError(limit)
    if proof["kind"] == "closure":
        yield from closure_problems(proof, case, lame=True, start=sets)
        return
    team, obstacles = case.team, case.obstacles
    closed = tuple(team.reach(name, sets[name], obstacles) for name in team.names)
    if all(
        team.can_continue(n, there, obstacles) for n, there in zip(team.names, closed, strict=True)
    ):
        yield "every robot is live before any of the choices"
        return
    proofs: dict[Choice, Mapping[str, Any]] = {}
    for choice in proof["choices"]:
        option = choice["option"]
        proofs[option["obstacle"], option["need"], frozenset(option["robots"])] = choice["proof"]
    steps = {
        (obstacles[k].name, obstacles[k].stage, frozenset(step.group)): step
        for step in team.options(closed, closed, obstacles, {}, every=True)
        for k in [step.obstacle]
    }
    missing = [one for one in steps if one not in proofs]
    chosen = [one for one in steps if one in proofs]
    lossless = [one for one in chosen if steps[one].lossless]
    if missing and not lossless:
        name, _, group = missing[0]
        yield f"{', '.join(sorted(group))} at {name} is not refuted"
        return
    for one in lossless[:1] if missing else chosen:
        after, then = team.after(steps[one], closed, obstacles)
        there = dict(zip(team.names, after, strict=True))
        left = tuple(obstacle for obstacle in then if obstacle.left)
        rest = replace(case, obstacles=left)
        yield from _problems(proofs[one], rest, there, budget, depth + 1)
