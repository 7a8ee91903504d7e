"""The most that a team can do, and what follows: obstacles that are never resolved, robots that can
never continue.

The closure has the poses that each robot can reach if every need is met whose regions enough robots
can reach. A robot that cannot continue there never can. Otherwise each choice of a group of robots
that meets the next need is followed; one after which all its robots can return stands for all.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cache
from itertools import combinations, product, takewhile
from typing import Any, NamedTuple

from safenav.judge.formulas import Formulas
from safenav.judge.state import Need, Obstacle, State
from safenav.judge.world import Graph, Poses, can_continue, reach

Sets = Mapping[str, Poses]


class TooLargeError(Exception):
    """A proof is too large for the judge."""


class Open(NamedTuple):
    """An open obstacle. ``left``: its unmet needs, the next one first; ``done``: the robots that
    have done their part of it; ``barred``: those that do not act on it, ``failed``: since that has
    failed; ``order``: rank by which robots take one of several loads."""

    name: str
    region: int
    blocks: frozenset[str]
    left: tuple[Need, ...]
    done: frozenset[str] = frozenset()
    barred: frozenset[str] = frozenset()
    failed: frozenset[str] = frozenset()
    order: tuple[str, int, int] = ("", 0, 0)

    def closes(self, robot: str) -> bool:
        """Return whether a robot must not enter its region."""
        last = self.left[-1] if self.left else None
        if last is None or robot not in self.blocks:
            return False
        alone = len(self.left) == 1 and last.robots == 1 and not last.same
        return not (alone and self.region in last.regions and robot in last.able - self.failed)

    def chain(self) -> tuple[Need, ...]:
        """Return the needs after the next one that the same robots must meet."""
        return tuple(takewhile(lambda need: need.same, self.left[1:]))

    def takes(self) -> bool:
        """Return whether the robots that meet the next need then carry a load."""
        return bool(self.chain()) and not self.left[0].same

    def carriers(self) -> frozenset[str]:
        if self.left and self.left[0].same:
            return self.left[0].able
        return self.done if self.takes() and not self.left[0].together else frozenset()

    def commits(self) -> bool:
        """Return whether meeting the next need determines the robots of a later one."""
        chosen = self.left[0].same and len(self.left[0].able) <= self.left[0].robots
        return bool(self.chain()) and not chosen

    def advanced(self, group: Iterable[str] = ()) -> Open:
        left, met = self.left[1:], self.done.union(group)
        if left and left[0].same:
            left = (left[0]._replace(able=left[0].able & met), *left[1:])
        return self._replace(left=left, done=frozenset())

    def acted(self, group: Iterable[str]) -> Open:
        """Return the obstacle after a group has done its part of the next need."""
        done = self.done.union(group)
        met = self.left[0].together or len(done) >= self.left[0].robots
        return self.advanced(group) if met else self._replace(done=done)


class Member(NamedTuple):
    """A robot: its ``steps`` outside permanent obstacles, the poses where each target is met, and
    whether it carries a load that no robot can ever put down."""

    steps: Graph
    aims: list[Poses]
    laden: bool = False


class Case:
    """``hopeful``: every robot counts as in service; ``memory``: the number of the memory of each
    robot whose poses are followed with it."""

    def __init__(
        self,
        s: State,
        *,
        hopeful: bool = False,
        memory: Mapping[str, int] | None = None,
    ) -> None:
        self.state, self.names, self.memory = s, s.names, memory or {}
        self.out = frozenset(n for n, r in s.robots.items() if r.out and not hopeful)
        every = s.obstacles.values()
        self.shut = frozenset(one.name for one in every if one.shut and not one.resolved)
        self.members = {name: self._member(name) for name in s.names}
        self.at: dict[str, Any] = {name: s.destination(name) for name in s.names}
        for name, number in self.memory.items():
            self.at[name] = (*self.at[name], number, frozenset())
        self.start = {name: frozenset([pose]) for name, pose in self.at.items()}
        known = (one for one in every if one.open and one.known)
        known = (one for one in known if not one.shut)
        self.obstacles = tuple(self._opened(one) for one in known)
        self._reach = cache(self._reached)

    def _member(self, name: str) -> Member:
        s, robot = self.state, self.state.robots[name]
        own, here = robot.own, s.destination(name)
        shut = [one for one in s.obstacles.values() if one.there and one.shut]
        laden = any(one.carried() and name in one.group for one in shut)
        if name in self.out:
            return Member({here: ()}, [frozenset([here])], laden)
        steps: Graph = s.world.graph(robot.faces)
        targets = own.targets[-1 if own.ends else 0 :]
        aims = [frozenset(p for p in steps if p[0] in target) for target in targets]
        if own.formulas is not None:
            steps = {
                a: tuple(b for b in to if own.formulas.allows(a, b)) for a, to in steps.items()
            }
            if own.kind == "ltl":
                every = own.formulas.goals
                aims = [_met(own.formulas, k, steps) for k in range(len(every))]
        sealed = own.avoid | {one.region for one in shut if name in one.blocks}
        if sealed:
            stays = robot.came is not None and robot.bound is None
            inside = stays and any(one.region == here[0] and name in one.blocks for one in shut)
            ahead = {b for b in steps.get(here, ()) if inside and b[0] != robot.came}
            steps = {
                a: tuple(b for b in to if b[0] not in sealed and not (a == here and b in ahead))
                for a, to in steps.items()
                if a[0] not in sealed or a == here
            }
        if name in self.memory and own.formulas is not None:
            return Member(*_with_memory(own.formulas, steps), laden)
        return Member(steps, aims, laden)

    def _opened(self, one: Obstacle) -> Open:
        s = self.state
        left = (one.need._replace(able=one.able()), *one.needs[one.stage + 1 :])
        left = tuple(
            need
            if need.same or not (chain := [*takewhile(lambda n: n.same, left[k + 1 :])])
            else need._replace(cut=frozenset(self._cut(need, chain)))
            for k, need in enumerate(left)
        )
        failed = frozenset(robot for robot, name in s.barred if name == one.name)
        barred = failed | (self.out if s.live else frozenset())
        done = frozenset[str]() if left[0].together else one.done
        number = one.name.partition("#")[2]
        order = one.type, one.region, int(number) if number.isdecimal() else 1
        about = one.name, one.region, one.blocks, left, done, barred, failed, order
        return Open(*about)

    def _cut(self, need: Need, later: Collection[Need]) -> Iterator[str]:
        """Yield the robots that do not take a load, since no path leads to where it is put down."""
        for name in need.able:
            there = self.state.robots[name]
            region = self.state.destination(name)[0]
            reached = self.state.world.connected(region, there.own.avoid)
            if any(reached.isdisjoint(one.regions) for one in later):
                yield name

    @staticmethod
    def walls(name: str, obstacles: Iterable[Open]) -> frozenset[int]:
        return frozenset(one.region for one in obstacles if one.closes(name))

    def _reached(self, name: str, poses: Poses, walls: frozenset[int]) -> Poses:
        return frozenset(reach(self.members[name].steps, poses, walls))

    def reach(self, name: str, poses: Poses, obstacles: Iterable[Open]) -> Poses:
        return self._reach(name, poses, self.walls(name, obstacles))

    def can_continue(self, name: str, poses: Iterable[Any], obstacles: Iterable[Open]) -> bool:
        """Return whether a robot can meet each target infinitely often from some of the poses."""
        member = self.members[name]
        return can_continue(member.steps, poses, member.aims, self.walls(name, obstacles))

    def all_continue(self, sets: Sets, obstacles: Iterable[Open]) -> bool:
        return all(self.can_continue(name, sets[name], obstacles) for name in self.names)

    def is_live(self, name: str, pose: Any, obstacles: Iterable[Open]) -> bool:
        outside = pose[0] not in self.walls(name, obstacles)
        return outside and self.can_continue(name, [pose], obstacles)

    def full(self, obstacles: Iterable[Open]) -> frozenset[str]:
        """Return the robots that carry a load, and so can take no other."""
        laden = frozenset(name for name in self.names if self.members[name].laden)
        return laden.union(*(one.carriers() for one in obstacles))

    def fits(self, group: Iterable[str], at: Sets) -> bool:
        """Return whether a group can stand at some of their poses simultaneously, rivals
        apart."""
        rivals, group = self.state.rivals, [*group]
        crowd = [name for name in group if {*rivals[name]} & {*group}]
        for regions in product(*({pose[0] for pose in at[name]} for name in crowd)):
            pairs = combinations(zip(crowd, regions, strict=True), 2)
            if all(one != other or b not in rivals[a] for (a, one), (b, other) in pairs):
                return True
        return False


def _met(formulas: Formulas, goal: int, steps: Graph) -> Poses:
    """Return the poses that meet a goal by staying, and the ends of the steps that meet it although
    staying at either end would not."""
    staying = {pose for pose in steps if formulas.meets(goal, pose, pose)}
    pairs = ((a, b) for a, to in steps.items() for b in to if not {a, b} & staying)
    return frozenset(staying | {b for a, b in pairs if formulas.meets(goal, a, b)})


def _with_memory(formulas: Formulas, steps: Graph) -> tuple[Graph, list[Poses]]:
    """Return the steps and aims of a robot whose poses are followed with their memory, and with the
    goals that only its last step has met. It may also stay and change its memory."""
    edges: dict[Any, set[Any]] = {}
    for here, to in steps.items():
        for there in (here, *to):
            for i, j, goals in formulas.steps(here, there):
                by_staying = formulas.met_by_staying(here, i) | formulas.met_by_staying(there, j)
                edges.setdefault((*here, i), set()).add((*there, j, goals - by_staying))
    states = {(*state, frozenset[int]()) for state in edges}.union(*edges.values())
    graph = {one: tuple(to for to in edges.get(one[:3], ()) if to != one) for one in states}
    aims = [
        frozenset(
            one
            for one in states
            if goal in one[3] or goal in formulas.met_by_staying(one[:2], one[2])
        )
        for goal in range(formulas.count)
    ]
    return graph, aims


def _stuck_at(one: Open, case: Case, inside: Sets, full: frozenset[str]) -> int | None:
    """Return the index of the first open need whose regions too few robots can reach, if there is
    one. ``full``: robots that can never take another load."""
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
            return number
    return None


def team_closure(
    case: Case, start: Sets, opened: tuple[Open, ...]
) -> tuple[Sets, tuple[Open, ...]]:
    """Return the poses that each robot can reach, and the obstacles that are never resolved, each
    with the need that is never met. ``start``: where the robots may be."""
    left = opened
    while True:
        inside = {name: case.reach(name, start[name], left) for name in case.names}
        full = case.full(one for one in left if one in opened)  # they carry their loads forever
        stages = [_stuck_at(one, case, inside, full) for one in opened]
        after = tuple(
            one._replace(left=one.left[stage:])
            for one, stage in zip(opened, stages, strict=True)
            if stage is not None
        )
        if after == left:
            return inside, left
        left = after


MOST_CHOICES = 10_000


def is_hopeless(case: Case) -> bool:
    """Return whether after every choice some robot can never continue. Raises TooLargeError."""
    states, seen = list[tuple[Sets, tuple[Open, ...]]]([(case.start, case.obstacles)]), 0
    while states:
        (sets, opened), seen = states.pop(), seen + 1
        if seen > MOST_CHOICES:
            raise TooLargeError(f"more than {MOST_CHOICES} choices of robots for obstacles")
        if not case.all_continue(*team_closure(case, sets, opened)):
            continue
        closed = {name: case.reach(name, sets[name], opened) for name in case.names}
        if case.all_continue(closed, opened):
            return False
        options = [*_options(case, closed, opened)]
        lossless = [one for one in options if one[2]]
        for k, at, _ in lossless[:1] or options:
            rest = (*opened[:k], opened[k].acted(at), *opened[k + 1 :])
            states.append(({**closed, **at}, tuple(each for each in rest if each.left)))
    return True


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
