"""Closures and trees.

A closure is a set of poses for each robot that it cannot leave, whatever is resolved: each robot
begins inside, no step leads out, every obstacle listed as never resolved has a need whose regions
too few robots reach, and some robot cannot continue in its set. A tree refutes every choice of a
group of robots that meets a need; one after which all its robots can return stands for all others.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from safenav.judge.lines import Line
from safenav.judge.proofs.case import Case, Open, Sets, TooLargeError
from safenav.judge.world import Poses

MOST_NODES, MOST_DEPTH = 10_000, 60


def closure_problems(
    proof: Line, case: Case, *, lame: bool, start: Sets | None = None, opened: tuple[Open, ...] = ()
) -> Iterator[str]:
    """Yield the errors of a closure. ``lame``: some robot must be unable to continue; ``start``:
    the possible poses of the robots, ``opened``: the obstacles (default: the present ones)."""
    never = [name for name in proof.never if name not in case.shut]
    known = {one.name: one for one in (case.obstacles if start is None else opened)}
    if unknown := [name for name in never if name not in known]:
        yield f"{', '.join(unknown)} is unknown or resolved, so it blocks no robot"
    elif forgotten := sorted(known.keys() - {*never, *proof.resolved}):
        yield f"the closure omits {', '.join(forgotten)}"
    elif proof.robots.keys() != case.at.keys():
        yield f"the closure covers {', '.join(sorted(proof.robots)) or 'no robot'}, not the team"
    else:
        inside = {name: table.poses for name, table in proof.robots.items()}
        carried = [known[name] for name in never]
        while True:  # loads whose next need is never met are carried forever
            full = case.full(carried)
            kept = [one for one in carried if next(_stuck_at(one, case, inside, full), None) == 0]
            if kept == carried:
                break
            carried = kept
        stages = {name: next(_stuck_at(known[name], case, inside, full), None) for name in never}
        for name, stage in stages.items():
            if stage is None:
                yield f"{name} can be resolved: enough robots reach its resolution regions"
                return
        stuck = tuple(
            known[name]._replace(left=known[name].left[stage:]) for name, stage in stages.items()
        )
        for name in case.names:
            begins = frozenset([case.at[name]]) if start is None else start[name]
            yield from _robot_problems(name, case, proof.robots[name], begins, stuck)
        if lame and all(table.live for table in proof.robots.values()):
            yield "the proof marks every robot as live, so it proves nothing"


def _stuck_at(one: Open, case: Case, inside: Sets, full: frozenset[str]) -> Iterator[int]:
    """Yield the indices of open needs whose regions too few robots can reach. ``full``: robots that
    can never take another load."""
    left, regions = one.left, {n: {pose[0] for pose in there} for n, there in inside.items()}
    for number, need in enumerate(left):
        begin = number
        while begin and left[begin].same:
            begin -= 1  # the same robots met it, so they reach its regions too
        able = frozenset.intersection(*(each.able for each in left[begin : number + 1]))
        able -= one.barred | (full if number == 0 and one.takes() else frozenset())
        able -= left[begin].cut - (one.done if begin == 0 else frozenset())
        able -= one.done if number == 0 else frozenset()
        able = frozenset(
            name
            for name in able
            if regions[name] & need.regions
            and all(
                regions[name] & left[k].regions or (k == 0 and name in one.done)
                for k in range(begin, number)
            )
        )
        missing = need.robots - (len(one.done) if number == 0 else 0)
        at = {n: frozenset(p for p in inside[n] if p[0] in need.regions) for n in sorted(able)}
        groups = combinations(at, max(missing, 0))
        apart = need.together and not any(case.fits(group, at) for group in groups)
        if len(at) < missing or apart:
            yield number


def _robot_problems(
    name: str, case: Case, table: Line, begins: Poses, stuck: tuple[Open, ...]
) -> Iterator[str]:
    if not begins <= table.poses:
        yield f"{name} begins outside its closure"
        return
    walls, steps = case.walls(name, stuck), case.members[name].steps
    for pose in table.poses:
        for to in steps.get(pose, ()):
            if to[0] not in walls and to not in table.poses:
                yield f"{name} can move from {pose[0]} to {to[0]}, outside its closure"
                return
    if not table.live and case.can_continue(name, table.poses, stuck):
        yield f"{name} can continue forever in its closure, but is marked not live"


def tree_problems(proof: Line, case: Case) -> Iterator[str]:
    """Yield the errors of a tree. Raises TooLargeError."""
    left = [MOST_NODES]
    sets = {name: frozenset([pose]) for name, pose in case.at.items()}
    yield from _node_problems(proof, case, sets, case.obstacles, left, 0)


def _node_problems(
    proof: Line, case: Case, sets: Sets, opened: tuple[Open, ...], left: list[int], depth: int
) -> Iterator[str]:
    left[0] -= 1
    if left[0] < 0 or depth > MOST_DEPTH:
        raise TooLargeError(f"a tree of more than {MOST_NODES} nodes, or deeper than {MOST_DEPTH}")
    if proof.kind == "closure":
        yield from closure_problems(proof, case, lame=True, start=sets, opened=opened)
        return
    if proof.kind != "tree":
        yield f"a {proof.kind} proof within a tree"
        return
    closed = {name: case.reach(name, sets[name], opened) for name in case.names}
    if all(case.can_continue(name, closed[name], opened) for name in case.names):
        yield "every robot is live before any of the choices"
        return
    proofs = {(c.option.obstacle, c.option.need, c.option.robots): c.proof for c in proof.choices}
    options = {
        (opened[k].name, opened[k].stage, frozenset(at)): (k, at, lossless)
        for k, at, lossless in _options(case, closed, opened)
    }
    chosen = [one for one in options if one in proofs]
    lossless = [one for one in chosen if options[one][2]]
    missing = [one for one in options if one not in proofs]
    if missing and not lossless:
        name, _, group = missing[0]
        yield f"{', '.join(sorted(group))} at {name} is not refuted"
        return
    for one in lossless[:1] if missing else chosen:
        k, at, _ = options[one]
        rest = (*opened[:k], opened[k].acted(at), *opened[k + 1 :])
        rest = tuple(each for each in rest if each.left)
        yield from _node_problems(proofs[one], case, {**closed, **at}, rest, left, depth + 1)


def _options(
    case: Case, sets: Sets, opened: tuple[Open, ...]
) -> Iterator[tuple[int, dict[str, Poses], bool]]:
    """Yield the groups that can meet the next need of an obstacle (its index), or robots that do
    their part of it, each with their poses there, and whether all can return from there."""
    full = case.full(opened)
    for k, one in enumerate(opened):
        need, then = one.left[0], (*opened[:k], one.advanced(), *opened[k + 1 :])
        able = need.able - one.done - one.barred - need.cut
        able -= full if one.takes() else frozenset()
        at = dict[str, Poses]()
        for name in (name for name in case.names if name in able):
            there = frozenset(p for p in sets[name] if p[0] in need.regions)
            at |= {name: there} if there else {}
        missing, free = max(1, need.robots - len(one.done)), not one.commits()

        def returns(name: str, after: tuple[Open, ...], at: Sets = at) -> bool:
            return sets[name] <= case.reach(name, at[name], after)

        for group in combinations(at, missing):
            if not need.together or case.fits(group, at):
                back = free and all(returns(name, then) for name in group)
                yield k, {name: at[name] for name in group}, back
        for name in at if missing > 1 and not need.together else ():
            yield k, {name: at[name]}, free and returns(name, opened)
