"""Trees: where irreversible choices matter, every possible choice, and a proof after each.

A choice is the present need of an obstacle and a group of robots that meets it. A choice from which
each robot of the group can return to every pose that it could reach before loses nothing, so it
stands for all others."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations

from safenav.audit.proofs.closure import Sets, closure_problems
from safenav.audit.proofs.moment import Moment, OpenObstacle, Pose
from safenav.audit.proofs.reading import MalformedError, mapping, names, sequence, whole

MOST_NODES = 10_000
MOST_DEPTH = 60


@dataclass(frozen=True)
class _Option:
    obstacle: str
    need: int
    robots: frozenset[str]


@dataclass
class _Budget:
    nodes: int = MOST_NODES


def tree_problems(proof: Mapping[str, object], moment: Moment) -> Iterator[str]:
    """Yield why a tree does not hold."""
    sets = {name: frozenset([robot.pose]) for name, robot in moment.robots.items()}
    yield from _problems(proof, moment, sets, _Budget(), 0)


def _problems(
    proof: Mapping[str, object], moment: Moment, sets: Sets, budget: _Budget, depth: int
) -> Iterator[str]:
    budget.nodes -= 1
    if budget.nodes < 0 or depth > MOST_DEPTH:
        yield f"the tree has more than {MOST_NODES} nodes or is deeper than {MOST_DEPTH}"
        return
    kind = proof.get("kind")
    if kind == "closure":
        yield from closure_problems(proof, moment, lame=True, start=sets)
        return
    if kind != "tree":
        raise MalformedError(f"{kind!r} within a tree")
    walls = {n: moment.walls(r, moment.obstacles.values()) for n, r in moment.robots.items()}
    closed = {n: moment.closure(r, sets[n], walls[n]) for n, r in moment.robots.items()}
    if all(not r.judged or moment.live(r, closed[n], walls[n]) for n, r in moment.robots.items()):
        yield "every robot is live before any of the choices"
        return
    told: dict[_Option, Mapping[str, object]] = {}
    for entry in sequence(proof.get("choices"), "choices"):
        choice = mapping(entry, "a choice")
        told[_option(mapping(choice.get("option"), "an option"))] = mapping(
            choice.get("proof"), "a choice's proof"
        )
    options = _options(moment, closed)
    chosen = [option for option in options if option in told]
    missing = [option for option in options if option not in told]
    lossless = [one for one in chosen if _is_lossless(one, moment, closed, walls)]
    if missing and not lossless:
        one = missing[0]
        yield f"{', '.join(sorted(one.robots))} at {one.obstacle} is not refuted"
        return
    for option in lossless[:1] if missing else chosen:
        after, there = _after(option, moment, closed)
        yield from _problems(told[option], after, there, budget, depth + 1)


def _option(data: Mapping[str, object]) -> _Option:
    obstacle = data.get("obstacle")
    if not isinstance(obstacle, str):
        raise MalformedError("the obstacle of an option must be a name")
    return _Option(
        obstacle, whole(data.get("need"), "need"), frozenset(names(data.get("robots"), "robots"))
    )


def _options(moment: Moment, closed: Sets) -> list[_Option]:
    """Return every need that is next for its obstacle, with every group of robots that could meet
    it."""
    found = []
    for name, obstacle in moment.obstacles.items():
        need = obstacle.needs[obstacle.stage]
        places = {
            one: frozenset(region for region, _ in closed[one]) & need.regions
            for one, robot in moment.robots.items()
            if obstacle.able(robot, obstacle.stage) and (need.together or one not in obstacle.done)
        }
        able = sorted(one for one, at in places.items() if at)
        for group in combinations(able, obstacle.missing(obstacle.stage)):
            if not need.together or moment.fits(group, places):
                found.append(_Option(name, obstacle.stage, frozenset(group)))
    return found


def _is_lossless(
    option: _Option, moment: Moment, closed: Sets, walls: Mapping[str, frozenset[int]]
) -> bool:
    regions = moment.obstacles[option.obstacle].needs[option.need].regions
    return not moment.obstacles[option.obstacle].commits() and all(
        moment.closure(moment.robots[name], _on(closed[name], regions), walls[name]) >= closed[name]
        for name in option.robots
    )


def _after(option: _Option, moment: Moment, closed: Sets) -> tuple[Moment, Sets]:
    obstacle = moment.obstacles[option.obstacle]
    regions = obstacle.needs[option.need].regions
    there = {
        name: _on(inside, regions) if name in option.robots else inside
        for name, inside in closed.items()
    }
    if option.need + 1 == len(obstacle.needs):
        return moment.without([obstacle.name]), there
    group = obstacle.done | option.robots
    further: OpenObstacle = replace(obstacle, stage=option.need + 1, done=frozenset(), group=group)
    return replace(moment, obstacles={**moment.obstacles, obstacle.name: further}), there


def _on(inside: frozenset[Pose], regions: frozenset[int]) -> frozenset[Pose]:
    return frozenset(pose for pose in inside if pose[0] in regions)
