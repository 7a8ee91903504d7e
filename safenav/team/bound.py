"""Lower bounds on the times of resolutions and rounds, the only proof of infeasible deadlines.

In this relaxation (h_max), robots do not collide and are never busy, and each obstacle opens at its
own earliest time. Turn ``tick * n + i`` is that of robot ``i`` of ``n`` in a tick. A step that
begins in tick t and takes d ticks ends in the robot's turn of tick t + d - 1.
"""

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from functools import lru_cache, reduce
from operator import or_

from msgspec import Struct

from safenav.team.state import State
from safenav.team.team import Member, Need, Team
from safenav.world.poses import Mask, PoseGraph, bits, region_mask

NEVER = 1 << 40

ByTick = dict[int, Mask]
"""Poses by the tick at whose end a robot can first be there; it may then wait there."""


class Walker(Struct, frozen=True, eq=False):
    """A robot in ``allowed`` poses. ``ticks``: the duration of its fastest step. ``gates``: pairs
    of a set of poses and the first tick in which the robot may depart for them, latest first."""

    graph: PoseGraph
    ticks: int
    allowed: Mask
    gates: Sequence[tuple[int, Mask]] = ()

    def spread(self, seeds: ByTick, goal: Mask = 0) -> tuple[ByTick, ByTick]:
        """Return two mappings from ticks to poses: those that the robot reaches from ``seeds``
        without crossing ``goal``, and those in ``goal`` where it arrives, or stays a tick."""
        waiting, found, met, seen = dict(seeds), ByTick(), ByTick(), 0
        for tick, poses in seeds.items():
            _add(met, tick + 1, poses & goal)
        while waiting:
            tick = min(waiting)
            found[tick] = waiting.pop(tick) & ~seen
            seen |= found[tick]
            ahead = self.graph.forward(found[tick]) & self.allowed
            for opens, closed in (*self.gates, (0, ahead)):
                ends = max(tick + 1, opens) + self.ticks - 1
                _add(met, ends, ahead & closed & goal)
                _add(waiting, ends, ahead & closed & ~goal & ~seen)
                ahead &= ~closed
        return found, met


def _add(to: ByTick, tick: int, poses: Mask) -> None:
    if poses:
        to[tick] = to.get(tick, 0) | poses


class Bound:
    """Bounds at one moment: after the turns of the first ``had`` robots in the present tick.
    ``times``: for each open obstacle the earliest turn in which each of its needs can be fulfilled.

    Obstacles that will disappear are ignored, and robots out of service count as in service, so the
    bounds stay lower bounds."""

    def __init__(self, team: Team, state: State, had: int) -> None:
        self.team, self.state, self.count = team, state, len(team.members)
        tick = int(state.time)
        self.now = tick * self.count + had - 1
        self.ready = [tick - (i >= had) for i in range(self.count)]
        """The tick at whose end each robot is in its next pose."""
        for i, robot in enumerate(state.robots):
            if robot.to is not None:
                self.ready[i] = max(self.ready[i] + 1, robot.due or 0)
        self.times: dict[int, tuple[int, ...]] = {}
        for k, there in enumerate(state.obstacles):  # given-up ones may be requested again
            obstacle = team.obstacles[k]
            if (k in state.requests or there.given_up) and obstacle.source.goes is None:
                met = there.stage.need
                self.times[k] = (self.now,) * met + (NEVER,) * (len(obstacle.needs) - met)
        before = None
        while before != self.times:  # each obstacle opens as early as others allow
            before, self.walkers = self.times, [self._walker(i) for i in range(self.count)]
            self.times = {k: tuple(map(min, self._needs(k), each)) for k, each in before.items()}

    def resolved(self, k: int) -> int:
        """Return the earliest tick in which an open obstacle can be resolved (NEVER if none), or
        the present tick if it will disappear."""
        *_, turn = self.times.get(k, (int(self.state.time) * self.count,))
        return NEVER if turn >= NEVER else turn // self.count

    def rounds_done(self, i: int, goals: Iterable[Mask]) -> int:
        """Return the earliest tick at whose end a robot can have met ``goals`` in sequence, each in
        a separate turn; NEVER if it cannot meet them."""
        met, robot = self._start(i), self.state.robots[i]
        arrives = robot.to is not None
        for goal in goals:
            _, met = self.walkers[i].spread(met, goal)
            if arrives and goal >> robot.next & 1:
                met[self.ready[i]] = 1 << robot.next
            arrives = False
        return min(met, default=NEVER)

    def _start(self, i: int) -> ByTick:
        return {self.ready[i]: 1 << self.state.robots[i].next}

    def _turn(self, i: int, need: Need, since: int) -> int:
        """Return the first turn from ``since`` on in which a robot can act on a need: any turn if
        the need is joint, else the robot's own."""
        return since if need.together else since + (i - since) % self.count

    def _walker(self, i: int) -> Walker:
        """Return the relaxed robot, for which each obstacle opens at one of the ``times``."""
        member, obstacles = self.team.members[i], self.team.obstacles
        gates = list[tuple[int, Mask]]()
        sealed = self.state.sealed.difference(self.times)
        lasting = (obstacles[k] for k in sealed if obstacles[k].source.goes is None)
        closed = {each.region for each in lasting if i in each.blocks}
        for k, turns in self.times.items():
            first, needs = self.state.obstacles[k].stage.need, obstacles[k].needs
            opens = first
            while opens < len(turns) and i in needs[opens].closed_to:
                opens += 1
            if opens > first and turns[opens - 1] >= NEVER:
                closed.add(obstacles[k].region)
            elif opens > first:
                tick = (turns[opens - 1] - i) // self.count + 1
                gates.append((tick, member.graph.poses_on(1 << obstacles[k].region)))
        allowed = ~member.graph.on(closed)
        return Walker(member.graph, member.ticks, allowed, sorted(gates, reverse=True))

    def _needs(self, k: int) -> list[int]:
        """Return the earliest turn of each need of an obstacle (the present turn if it is
        fulfilled). Several needs may be fulfilled in one turn."""
        stage, needs = self.state.obstacles[k].stage, self.team.obstacles[k].needs
        found, done, since = [self.now] * stage.need, stage.done, self.now + 1
        begins = {i: self._start(i) for i in stage.group or ()}
        for need in needs[stage.need :]:
            if not need.same:
                begins = {i: self._start(i) for i in range(self.count)}
            fields = {
                i: self.walkers[i].spread(poses)[0]
                for i, poses in begins.items()
                if poses and need.skills <= self.team.members[i].robot.capabilities
            }
            parts = (self._takes_part(i, fields[i], need, since) for i in fields if i not in done)
            turns = sorted(parts)
            missing = need.robots - len(done)
            met = turns[missing - 1 : missing] if missing > 0 else [since]
            found.append(min([NEVER, *met]))
            ends = found[-1] if need.together else since
            begins = {i: self._after(i, fields[i], need, ends) for i in fields}
            begins |= {i: self._start(i) for i in done}
            done, since = frozenset(), found[-1]
        return found

    def _takes_part(self, i: int, field: ByTick, need: Need, since: int) -> int:
        """Return the first turn from ``since`` on in which a robot can take part in a need."""
        places = self.team.members[i].graph.poses_on(need.regions)
        tick = min((tick for tick, poses in field.items() if poses & places), default=NEVER)
        turn = self._turn(i, need, max(tick * self.count + i, since))
        return min(turn, self._leaving(i, need, since))

    def _after(self, i: int, field: ByTick, need: Need, since: int) -> ByTick:
        """Return the poses, by tick, from which a robot continues after its part of a need that is
        fulfilled from turn ``since`` on. It may have done its part long before."""
        if self._leaving(i, need, since) < NEVER:
            return self._start(i)
        # the robot can still act, also in a group, until it arrives elsewhere
        left = (self._turn(i, need, since) - i) // self.count + 1 - self.team.members[i].ticks
        places, found = self.team.members[i].graph.poses_on(need.regions), ByTick()
        for tick, poses in field.items():
            _add(found, max(tick, left), poses & places)
        return found

    def _leaving(self, i: int, need: Need, since: int) -> int:
        """Return the first turn from ``since`` on in which a robot in transit can take part in a
        need at its departure pose; NEVER if it arrives earlier."""
        robot = self.state.robots[i]
        if robot.to is None or not need.regions >> robot.pose % self.team.size & 1:
            return NEVER
        turn = self._turn(i, need, since)
        return turn if turn < self.ready[i] * self.count + i else NEVER


def least_first(member: Member, start: int, first: int) -> tuple[int | None, int]:
    """Return the least number of ticks for each round (None: there is none), and the target with
    which a robot then begins: ``first``, unless that is too late and it may begin with any target.
    The rounds of a literal objective touch no other targets on the way if possible."""
    strict = least_within(member, start, strict=True) if member.objective.literal else None
    if strict is not None:
        return strict, first
    choices = range(len(member.targets)) if member.either else [first]
    ends = {k: least_within(member, start, strict=False, first=k) for k in choices}
    within, best = member.robot.within, ends[first]
    if best is None or (within is not None and best > within):
        first = min(choices, key=lambda k: NEVER if (n := ends[k]) is None else n)
    return ends[first], first


@lru_cache(maxsize=64)
def least_within(member: Member, start: int, *, strict: bool, first: int = 0) -> int | None:
    """Return the least N such that a robot alone can complete every round in N ticks, forever; None
    if there is none. ``strict``: whether it touches no other target on the way to a target (the
    paper's patrol); ``first``: the target with which it begins.

    The result is exact. Let K be the greatest set of poses of the last target from which a round of
    at most N ticks leads back into K. The first round must lead into K in time."""
    targets = member.targets[first:] + member.targets[:first]
    every = reduce(or_, targets) if strict else 0  # targets of a patrol share no region

    def round_from(pose: int, goals: Sequence[Mask] = targets) -> ByTick:
        """Return, for each number of ticks, the poses where a round from ``pose`` can end."""
        met = {0: 1 << pose}
        for target in goals:
            allowed = member.floor & ~(every & ~target)
            _, met = Walker(member.graph, member.ticks, allowed).spread(met, target & member.floor)
        return met

    begin = round_from(start, targets[targets[0] >> start & 1 :])  # a start counts in tick 0
    rounds = {pose: round_from(pose) for pose in bits(targets[-1] & member.floor)}

    def lasts(most: int) -> bool:
        before, kept = None, region_mask(rounds)

        def leads(found: ByTick) -> bool:
            return any(poses & kept for ticks, poses in found.items() if ticks <= most)

        while before != kept:
            before, kept = kept, region_mask(pose for pose in bits(kept) if leads(rounds[pose]))
        return leads(begin)

    values = sorted({*begin}.union(*rounds.values()))
    least = bisect_left(values, True, key=lasts)
    return values[least] if least < len(values) else None
