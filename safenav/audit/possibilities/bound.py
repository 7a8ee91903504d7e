"""Lower bounds on the times of resolutions and rounds, computed from a trace alone.

The bounds ignore collisions and assume that robots are never busy and that each open obstacle is
gone from the earliest turn in which all its needs could be met (docs/deadlines.md). Turn ``tick * n
+ i`` is that of robot i.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from heapq import heappop, heappush
from itertools import product

from safenav.audit.formulas import rules_of
from safenav.audit.kinds import shape_of
from safenav.audit.language import Pose
from safenav.audit.lines import Line
from safenav.audit.run.situation import Situation

NEVER = 1 << 40
Ticks = dict[Pose, int]


class Bound:
    """Bounds at the end of a turn. ``had``: the number of robots that have had their turn in this
    tick."""

    def __init__(self, now: Situation, tick: int, had: int) -> None:
        self.now, self.names = now, [*now.header.robots]
        self.turn = tick * len(self.names) + had - 1
        self.start: dict[str, tuple[Pose, int]] = {}
        self.until: dict[str, int] = {}  # latest arrival of robots in transit
        for index, name in enumerate(self.names):
            ready = tick if index < had else tick - 1
            if now.toward[name] is not None:
                since = now.set_out.get(name, tick)
                self.until[name] = ready = max(ready + 1, since + self.takes(name) - 1)
            self.start[name] = (now.pose(name), ready)
        self.sealed = {
            name: {
                o.region
                for o in now.obstacles.values()
                if now.status[o.name].stays and o.until is None and name in o.blocks
            }
            for name in self.names
        }
        requested = [now.obstacles[name] for name in now.requests]
        self.open = [o for o in requested if o.until is None]  # else it may be gone by then
        self.ends = {obstacle.name: NEVER for obstacle in self.open}
        self.met = {
            o.name: [
                self.turn if number < now.open[o.name].stage else NEVER
                for number in range(len(o.all_needs))
            ]
            for o in self.open
        }
        changed = True
        while changed:
            found = {obstacle.name: self._needs(obstacle) for obstacle in self.open}
            changed = found != self.met
            self.met = found
        self.ends = {name: turns[-1] for name, turns in self.met.items()}

    def resolution(self, obstacle: str) -> int | None:
        """Return the earliest tick in which an open obstacle can be resolved; None: never."""
        turn = self.ends.get(obstacle, self.turn)
        return None if turn >= NEVER else turn // len(self.names)

    def round(self, robot: str, goals: Iterable[frozenset[int]]) -> int | None:
        """Return the earliest tick by whose end a robot can have met some targets in sequence."""
        pose, ready = self.start[robot]
        seeds = {pose: ready}
        arrives = self.now.toward[robot] is not None
        for goal in goals:
            ticks, stepped = self.ticks(robot, seeds)
            met = {}
            for at, tick in ticks.items():
                if at[0] in goal:
                    met[at] = min(stepped.get(at, NEVER), tick + 1)
            if arrives and pose[0] in goal:
                met[pose] = ready
            arrives = False
            if not met:
                return None
            seeds = met
        return min(seeds.values())

    def takes(self, robot: str) -> int:
        """Return the ticks of a robot's step."""
        return int(self.now.header.robots[robot].timing or 1)

    def sets_out(self, robot: str, turn: int) -> int:
        """Return the tick after which a robot can depart and still be in its region in that turn:
        it occupies the region until it arrives."""
        return (turn - self.names.index(robot)) // len(self.names) + 1 - self.takes(robot)

    def leaving(self, robot: str, need: Line, since: int) -> int:
        """Return the first turn from ``since`` on in which a robot in transit can do its part of a
        need in the region that it leaves; NEVER if there is none."""
        if self.now.toward[robot] is None or self.now.region[robot] not in need.regions:
            return NEVER
        own, count = self.names.index(robot), len(self.names)
        turn = since if need.together else since + (own - since) % count
        return turn if turn < self.until[robot] * count + own else NEVER

    def _closed_until(self, robot: str, region: int) -> int:
        """Return the turn after which a robot may enter a region; -1: now."""
        after = -1
        for obstacle in self.open:
            if obstacle.region != region or robot not in obstacle.blocks:
                continue
            one, met = self.now.open[obstacle.name], self.met[obstacle.name]
            if not one.ends_by_entering(robot):
                after = max(after, met[-1])
            elif len(one.left) > 1:
                after = max(after, met[-2])
        return after

    def ticks(
        self,
        robot: str,
        seeds: Ticks,
        ends_in: Collection[int] = (),
        allows: Callable[[Pose, Pose], bool] | None = None,
    ) -> tuple[Ticks, Ticks]:
        """Return, for each pose, the earliest tick at whose end a robot is there, and the earliest
        in which a step ends there. ``seeds``: poses with the ticks at which the robot may start;
        ``ends_in``: regions where paths may end but not continue; ``allows``: the steps that it may
        take (None: all of its mobility)."""
        own, takes = self.names.index(robot), self.takes(robot)
        mobility = self.now.header.robots[robot].mobility
        best, stepped = dict(seeds), Ticks()
        queue = sorted((tick, str(pose), pose) for pose, tick in seeds.items())
        while queue:
            tick, _, pose = heappop(queue)
            if tick > best[pose]:
                continue
            for there in self.now.grid.steps(mobility, pose):
                if there[0] in self.sealed[robot] or (allows and not allows(pose, there)):
                    continue
                after = self._closed_until(robot, there[0])
                if after >= NEVER:
                    continue
                begins = max(tick + 1, (after - own) // len(self.names) + 1)
                ends = begins + takes - 1
                stepped[there] = min(stepped.get(there, NEVER), ends)
                if ends < best.get(there, NEVER) and there[0] not in ends_in:
                    best[there] = ends
                    heappush(queue, (ends, str(there), there))
        return best, stepped

    def _needs(self, obstacle: Line) -> list[int]:
        count, one = len(self.names), self.now.open[obstacle.name]
        needs = (*obstacle.all_needs[: one.stage], *one.left)
        stage = len(needs) - len(one.left)
        turns, before = [self.turn] * stage, self.turn + 1
        begun = before
        fields: dict[str, Ticks] = {}
        for number in range(stage, len(needs)):
            need, former, fields = needs[number], fields, {}
            arrivals = []
            for index, name in enumerate(self.names):
                if number == stage and name in one.done and not need.together:
                    fields[name] = self.ticks(name, dict([self.start[name]]))[0]
                    continue
                if name not in need.able:
                    continue
                seeds = dict([self.start[name]])
                if need.same and number > stage:
                    if name not in former:
                        continue
                    # if not together, it may have acted and left before the others acted
                    earlier, alone = needs[number - 1], not needs[number - 1].together
                    part_at = begun + (index - begun) % count if alone else before
                    since, places = self.sets_out(name, part_at), earlier.regions
                    took_part = number - 1 == stage and name in one.done
                    took_part = took_part and alone
                    if not took_part and self.leaving(name, earlier, part_at) >= NEVER:
                        had = former[name].items()
                        seeds = {p: max(t, since) for p, t in had if p[0] in places}
                fields[name] = self.ticks(name, seeds)[0]
                there = [t for p, t in fields[name].items() if p[0] in need.regions]
                turn = max(min(there) * count + index, before) if there else NEVER
                if there and not need.together:
                    turn += (index - turn) % count
                turn = min(turn, self.leaving(name, need, before))
                if turn < NEVER:
                    arrivals.append(turn)
            begun = before
            had_part = 0 if need.together or number > stage else len(one.done)
            missing = need.robots - had_part
            arrivals.sort()
            before = arrivals[missing - 1] if len(arrivals) >= missing else NEVER
            turns.append(before)
            if before >= NEVER:
                return turns + [NEVER] * (len(needs) - len(turns))
        return turns


def mission_end(bound: Bound) -> int | None:
    """Return the earliest tick at which the whole mission can be completed; None if it never can. A
    target on which a robot starts is met at tick 0. A strict objective may begin with any of its
    targets, a literal one only with the first or with that on which the robot starts."""
    now, ends = bound.now, [0]
    rounds = now.header.until.rounds or 1
    for name in now.header.robots:
        objective, shape = now.own[name], shape_of(now.own[name].kind)
        if not shape.ordered:
            continue
        targets, start = [*objective.targets], bound.start[name][0][0]
        firsts = {0}
        if shape.strict:
            free = not objective.literal
            firsts |= {k for k, target in enumerate(targets) if free or start in target}
        found = {NEVER}
        for first in firsts:
            goals = (targets[first:] + targets[:first]) * (1 if shape.settles else rounds)
            if shape.settles:
                goals += targets[-1:] * (rounds - 1)
            left = goals[1:] if start in goals[0] else goals
            end = bound.round(name, left) if left else 0
            found.add(NEVER if end is None else end)
        ends.append(min(found))
    return None if max(ends) >= NEVER else max(ends)


def goals_left(
    robot: str, now: Situation, firsts: Mapping[str, int], rounds: int = 1
) -> Iterator[list[frozenset[int]]]:
    """Yield the possible sequences of targets that a robot must still meet to complete ``rounds``
    rounds, the present one included. A strict objective without a met target may begin with any,
    unless a strategy determines the first one (``firsts``)."""
    own, progress = now.own[robot], now.progress[robot]
    targets, count, turn = own.targets, len(own.targets), progress.next(own)
    left = max(count * rounds - len(progress.met), 0)
    begins = [turn or 0]
    if turn is None and shape_of(own.kind).strict:
        begins = [firsts[robot]] if robot in firsts else [*range(count)]
    for first in begins:
        yield [targets[(first + k) % count] for k in range(left)]


def mission_ends(bound: Bound, tick: int, firsts: Mapping[str, int]) -> set[int | None]:
    """Return the earliest ticks at which the whole mission can be completed from now on: several if
    a robot may begin with any target."""
    now = bound.now
    ends: list[set[int | None]] = [{tick}]
    wanted = now.header.until.rounds or 1
    for name in now.header.robots:
        progress, targets = now.progress[name], now.own[name].targets
        shape = shape_of(now.own[name].kind)
        if shape.settles:
            first = progress.ahead if shape.in_turn else 0
            choices = [[*targets[first:]] if progress.rounds < 1 else []]
        elif shape.in_turn:
            choices = [*goals_left(name, now, firsts, wanted - progress.rounds)]
        else:
            continue
        found = {bound.round(name, goals) for goals in choices if goals}
        ends += [found] if found else []
    return {
        None if None in choice else max(end for end in choice if end is not None)
        for choice in product(*ends)
    }


def least_within(now: Situation, robot: str) -> int | None:
    """Return the least number of ticks in which a robot alone can complete every round forever,
    under the rules of its objective; None if there is none. A literal strict objective takes the
    least number without touching a target out of turn, if there is one."""
    own = now.own[robot]
    strict = _least_round(now, robot, True) if own.literal and shape_of(own.kind).strict else None
    return _least_round(now, robot, False) if strict is None else strict


def _least_round(now: Situation, robot: str, strict: bool) -> int | None:
    bound = Bound(now, 0, len(now.header.robots))
    own = now.own[robot]
    targets, rules = own.targets, rules_of(own) if own.always else None
    every = frozenset[int]().union(*targets)

    def allows(before: Pose, after: Pose) -> bool:
        return after[0] not in own.avoid and (rules is None or rules.allows(before, after))

    def round_from(seeds: Ticks) -> Ticks:
        for goal in targets:
            stayed, stepped = bound.ticks(robot, seeds, every if strict else goal, allows)
            seeds = {
                pose: min(stepped.get(pose, NEVER), stayed.get(pose, NEVER) + 1)
                for pose in stayed.keys() | stepped.keys()
                if pose[0] in goal
            }
        return seeds

    first, rounds = round_from(dict([bound.start[robot]])), dict[Pose, Ticks]()
    pending = [*first]
    while pending:
        pose = pending.pop()
        if pose not in rounds:
            rounds[pose] = round_from({pose: 0})
            pending += rounds[pose]
    for most in sorted({*first.values(), *(t for row in rounds.values() for t in row.values())}):
        kept = {*rounds}
        while True:
            rest = {p for p in kept if any(t <= most and q in kept for q, t in rounds[p].items())}
            if rest == kept:
                break
            kept = rest
        if any(tick <= most and pose in kept for pose, tick in first.items()):
            return most
    return None
