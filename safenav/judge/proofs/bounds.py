"""Lower bounds on the times of resolutions, rounds and the mission (docs/deadlines.md).

The bounds ignore collisions and assume that robots are never busy and each open obstacle disappears
in the earliest turn in which its needs can be fulfilled. Turn ``tick * n + i`` is that of robot i.
No run is faster, so a deadline before a bound is lost.
"""

from collections.abc import Collection, Iterable, Iterator
from functools import cache
from heapq import heappop, heappush
from math import ceil

from safenav.judge.formulas import Pose
from safenav.judge.lines import Line
from safenav.judge.progress import Progress
from safenav.judge.proofs.closures import Case
from safenav.judge.state import Need, Rest, Robot, State
from safenav.judge.world import closure

NEVER = 1 << 40
Ticks = dict[Pose, int]
Charges = dict[Pose, float]


class Bound:
    """Lower bounds on times, computed from each robot's pose and the tick at which it is there.
    ``met``: for each open obstacle, the earliest turn in which each open need can be fulfilled.
    Formulas of objectives that the scenario still changes are ignored."""

    def __init__(self, s: State, tick: int) -> None:
        self.s, self.tick, self.names, self.count = s, tick, s.names, len(s.names)
        self.changes = objectives_change(s, tick)
        had = sum(robot.moved >= tick for robot in s.robots.values())
        self.turn = tick * self.count + had - 1
        self.start: dict[str, Ticks] = {}
        for name, robot in s.robots.items():
            ready = tick if robot.moved >= tick else tick - 1
            if robot.bound is not None:
                ready = max(ready + 1, robot.began + robot.data.timing - 1)
            self.start[name] = {s.destination(name): ready}
        lasting = [one for one in s.obstacles.values() if one.there and one.goes is None]
        shut = [one for one in lasting if one.permanent]
        self.sealed = {name: {one.region for one in shut if name in one.blocks} for name in s.names}
        known = (one for one in lasting if one.open and one.known and not one.permanent)
        self.open = [one.rest for one in known if one.rest.left]
        self.met = {one.name: [NEVER] * len(one.left) for one in self.open}
        before: dict[str, list[int]] = {}
        while before != self.met:
            before, self.met = self.met, {one.name: self._needs(one) for one in self.open}

    def resolution(self, name: str) -> int:
        turn = self.met[name][-1] if name in self.met else self.turn
        return NEVER if turn >= NEVER else turn // self.count

    def round(self, name: str, goals: Iterable[frozenset[int]]) -> int:
        """Return the earliest tick by whose end a robot can have met these targets in sequence."""
        arrives = self.s.robots[name].bound is not None or not self.tick  # or the run starts
        seeds = self.start[name]
        for goal in goals:
            there = {p: t for p, t in seeds.items() if arrives and p[0] in goal}
            seeds, arrives = self.goal(name, goal, seeds) | there, False
        return min(seeds.values(), default=NEVER)

    def goal(
        self, name: str, goal: frozenset[int], seeds: Ticks, ends_in: Collection[int] = ()
    ) -> Ticks:
        """Return each pose in which a robot can meet a target, with the earliest tick by whose end
        it can have met the target there, by a step or a stay."""
        stayed, stepped = self.ticks(name, seeds, ends_in)
        there = (pose for pose in stayed.keys() | stepped.keys() if pose[0] in goal)
        return {p: min(stepped.get(p, NEVER), stayed.get(p, NEVER) + 1) for p in there}

    def ticks(self, name: str, seeds: Ticks, ends_in: Collection[int] = ()) -> tuple[Ticks, Ticks]:
        """Return two mappings from poses to ticks: the earliest at whose end a robot can be there,
        and the earliest in which a step can end there. Paths end in regions of ``ends_in``."""
        own, robot = self.names.index(name), self.s.robots[name]
        formulas = None if self.changes else robot.own.formulas
        best, stepped, shut = dict(seeds), Ticks(), self.sealed[name]
        queue = sorted((tick, str(pose), pose) for pose, tick in seeds.items())
        while queue:
            tick, _, pose = heappop(queue)
            self.s.world.spend()
            for there in self.s.world.steps(robot.faces, pose):
                legal = formulas is None or formulas.allows(pose, there)
                after = self._closed_until(name, there[0])
                if not legal or there[0] in shut or after >= NEVER:
                    continue
                ends = max(tick + 1, (after - own) // self.count + 1) + robot.data.timing - 1
                stepped[there] = min(stepped.get(there, NEVER), ends)
                if ends < best.get(there, NEVER) and there[0] not in ends_in:
                    best[there] = ends
                    heappush(queue, (ends, str(there), there))
        return best, stepped

    def _closed_until(self, name: str, region: int) -> int:
        """Return the turn after which a robot may enter a region (-1: it may enter now)."""
        here = (one for one in self.open if one.region == region and one.closes(name))
        turns = (self.met[one.name][-2 if name in one.enters else -1] for one in here)
        return max(turns, default=-1)

    def _leaving(self, name: str, need: Need, since: int) -> int:
        """Return the first turn from ``since`` on in which a robot in transit can do its part of a
        need in the region that it leaves; NEVER if there is none."""
        robot, own = self.s.robots[name], self.names.index(name)
        if robot.bound is None or robot.pose[0] not in need.regions:
            return NEVER
        turn = since if need.together else since + (own - since) % self.count
        (ready,) = self.start[name].values()
        return turn if turn < ready * self.count + own else NEVER

    def _needs(self, one: Rest) -> list[int]:
        """Return the earliest turn in which each open need of an obstacle can be fulfilled."""
        turns, fields = list[int](), dict[str, Ticks]()
        begun = before = self.turn + 1
        for number, need in enumerate(one.left):
            former, fields, arrivals = fields, {}, list[int]()
            done = frozenset[str]() if need.together or number else one.done
            for index, name in enumerate(self.names):
                seeds = self.start[name]
                if number and need.same:
                    seeds = self._seeds(one, number, name, former.get(name, {}), begun, before)
                if not seeds or name not in need.able | done:
                    continue
                fields[name], _ = self.ticks(name, seeds)
                there = [tick for pose, tick in fields[name].items() if pose[0] in need.regions]
                turn = max(min(there) * self.count + index, before) if there else NEVER
                if not need.together:
                    turn += (index - turn) % self.count
                arrivals += [min(turn, self._leaving(name, need, before))] * (name not in done)
            begun, arrivals = before, sorted(turn for turn in arrivals if turn < NEVER)
            missing = need.robots - len(done)
            if missing > 0:  # if not, the last action failed, but may be repeated
                before = arrivals[missing - 1] if len(arrivals) >= missing else NEVER
            turns.append(before)
        return turns

    def _seeds(
        self, one: Rest, number: int, name: str, former: Ticks, begun: int, before: int
    ) -> Ticks:
        """Return the poses from which a robot may go to a need after its part in the previous need,
        each with its earliest tick; the mapping is empty if it took no part."""
        earlier, index = one.left[number - 1], self.names.index(name)
        part_at = before if earlier.together else begun + (index - begun) % self.count
        had_part = number == 1 and name in one.done and not earlier.together
        if former and (had_part or self._leaving(name, earlier, part_at) < NEVER):
            return self.start[name]
        since = (part_at - index) // self.count + 1 - self.s.robots[name].data.timing
        return {p: max(t, since) for p, t in former.items() if p[0] in earlier.regions}


def objectives_change(
    s: State, tick: int, names: Collection[str] | None = None, most: int = NEVER
) -> bool:
    """Return whether the scenario assigns another objective, perhaps with other formulas, to one of
    the robots ``names`` (None: any) after ``tick`` and until ``most``."""
    names = s.names if names is None else names
    changes = (one for one in s.scenario.changes if one.robot in names)
    times = [one.at for one in changes if one.objective is not None]
    if any(s.robots[name].data.when for name in names):
        spans = (span for each in s.scenario.inputs for span in each.spans)
        times += [at for first, last in spans for at in (first, last + 1)]
    return any(tick < at <= most for at in times)


def _left(robot: Robot, wanted: int, tick: int) -> Iterator[list[frozenset[int]]]:
    """Yield the possible sequences of targets that a robot still has to meet (in tick 0 all). A
    patrol may begin with any target, a literal patrol only with the target where it stands."""
    own, progress = robot.own, robot.progress if tick else Progress()
    if own.settles:  # each tick at the last target is a round; the robot must end there
        away = robot.bound is not None or robot.pose[0] not in own.last
        stays = max(wanted - progress.rounds(own, tick), int(away))
        yield own.targets[progress.turn or 0 : -1] + [own.last] * stays
        return
    left, turn = max(own.count * wanted - progress.goals, 0), progress.turn
    begins = turn if turn is not None else robot.first if own.strict and tick else None
    free = own.strict and not progress.goals and (turn is not None or begins is None)
    here = (k for k, t in enumerate(own.targets) if not own.literal or robot.pose[0] in t)
    for first in {(begins or 0) % own.count, *(here if free else ())}:
        yield [own.targets[(first + k) % own.count] for k in range(left)]


def mission(bound: Bound, tick: int) -> int:
    """Return a tick before which the mission cannot be completed (the present tick if the scenario
    still changes objectives)."""
    s = bound.s
    ends: list[int] = [tick, *(each.appears for each in s.coming if each.ordered)]
    wanted = s.scenario.until.rounds
    if bound.changes:
        return tick
    for name, robot in s.robots.items():
        if robot.own.ordered:
            s.world.spend(robot.own.count * wanted)
            left = [*_left(robot, wanted, tick)]
            s.world.spend(sum(map(len, left)))
            ends.append(min(bound.round(name, one) if one else tick for one in left))
    return max(ends)


def bound_problems(e: Line, s: State) -> Iterator[str]:
    """Yield the reasons why a deadline recorded as lost may still be met, or may be met before the
    stated tick ``earliest``. Raises TooLargeError."""
    bound = Bound(s, e.tick)
    if e.of == "mission":
        least = mission(bound, e.tick)
    elif e.of in s.robots:
        robot = s.robots[e.of]
        if objectives_change(s, e.tick, [e.of], e.due):
            yield f"{e.of} gets another objective before its round is due"
        if not robot.own.ordered:
            yield f"{e.of} may visit its targets in any order: no bound shows that a round is lost"
            return
        done = robot.progress.rounds(robot.own, e.tick) if robot.own.in_turn else 0
        least = min(bound.round(e.of, one) for one in _left(robot, done + 1, e.tick))
    else:
        least = bound.resolution(e.of)
    if e.verdict == "lost" and least <= e.due:
        yield f"{e.of} is recorded as lost, but may be in time in tick {least}"
    elif e.earliest is not None and e.earliest > least:
        yield f"{e.of} is possible from tick {least} on, not {e.earliest}"


def refused_problems(e: Line, s: State) -> Iterator[str]:
    """Yield the reasons why a deadline or charge that the trace refuses at the start may suffice.
    Raises TooLargeError."""
    for of, stated in e.refused.items():
        name = of.removesuffix(".battery")
        robot, most = s.robots.get(name), s.by if of == "mission" else None
        if robot is not None and robot.own.ordered:
            most = robot.within if name == of else None if s.flat_type else robot.charge
        if most is None:
            yield f"{of} is refused, but no deadline or charge limits it"
            continue
        if robot and objectives_change(s, 0, [name], int(most) if name == of else NEVER):
            yield f"{of} is refused, but {name} gets another objective"
        if robot is None:
            least = mission(Bound(s, 0), 0)
        else:
            least = least_within(s, name) if name == of else charge_needed(robot, s)
        if least <= most:
            yield f"{of} is refused, but {most:g} suffices: the least is {least}"
        elif (NEVER if stated is None else stated) != min(least, NEVER):
            yield f"{of} is refused with a least value of {stated}; it is {least}"


def least_within(s: State, name: str) -> int:
    """Return the least N such that a robot alone can complete each round in N ticks, forever."""
    own = s.robots[name].own
    s.world.spend(own.count**2 * own.strict)
    every = frozenset[int]().union(*own.targets) if own.literal and own.strict else None
    for ends_in in dict.fromkeys((every, None)):  # a literal patrol, if possible
        least = min(_least_round(s, name, one, ends_in) for one in _left(s.robots[name], 1, 0))
        if least < NEVER:
            break
    return least


def _least_round(
    s: State, name: str, targets: list[frozenset[int]], ends_in: Collection[int] | None
) -> int:
    """Return the least number of ticks of a round of targets in this order. ``ends_in``: regions
    that the robot touches only at the end of a path to a target (None: those of that target)."""
    bound, own = Bound(s, 0), s.robots[name].own
    bound.changes = False  # as long as the robot has this objective
    bound.sealed[name] |= own.avoid

    def round_from(seeds: Ticks, goals: list[frozenset[int]] = targets) -> Ticks:
        for goal in goals:
            seeds = bound.goal(name, goal, seeds, ends_in or goal)
        return seeds

    begun = s.robots[name].pose[0] in targets[0]  # this counts in tick 0
    first = round_from(bound.start[name], targets[begun:])
    after = cache(lambda pose: round_from({pose: 0}))
    rounds = {pose: after(pose) for pose in closure(first, after)}
    slowest, before = dict.fromkeys(rounds, 0), Ticks()  # of one, two, three, ... rounds

    def least(ticks: Ticks) -> int:
        return min((max(tick, slowest[pose]) for pose, tick in ticks.items()), default=NEVER)

    while slowest != before:
        s.world.spend(len(slowest))
        before, slowest = slowest, {pose: least(ticks) for pose, ticks in rounds.items()}
    return least(first)


def charge_needed(robot: Robot, s: State) -> int:
    """Return the least charge with which a robot can meet its targets in turn forever: a fixpoint
    over the poses."""
    battery, own, chargers = robot.data.battery, robot.own, s.scenario.chargers
    steps = Case(s, out=[name for name, one in s.robots.items() if one.out]).steps[robot.name]
    after = {pose: steps.get(pose, ()) for pose in s.world.reach(steps, [robot.pose], ())}

    def leg(target: frozenset[int], then: Charges) -> Charges:
        """Return, for each pose, the least charge with which the robot meets a target, by a step or
        a stay, and then has the charge ``then``."""
        found, changed = Charges(), True
        while changed:
            changed = False
            s.world.spend(len(after))
            for pose, to in after.items():
                full = pose[0] in chargers
                charges = [then[q] + battery.move for q in to if q[0] in target and q in then]
                charges += [found[q] + battery.move for q in to if q in found]
                if pose[0] in target and pose in then:
                    stays = then[pose] if full else max(then[pose] + battery.stay, battery.move)
                    charges.append(stays)
                charge = min((c for c in charges if c <= battery.capacity), default=NEVER)
                charge = 0 if full and charge < NEVER else charge
                if charge < found.get(pose, NEVER):
                    found[pose], changed = charge, True
        return found

    needs, before = [dict.fromkeys(after, 0.0) for _ in own.targets], list[Charges]()
    while needs != before:
        before, last = needs, needs[-1] if own.settles else needs[0]
        legs = map(leg, own.targets, [*needs[1:], last])
        needs = [
            {pose: max(charge, old[pose]) for pose, charge in new.items() if pose in old}
            for new, old in zip(legs, before, strict=True)
        ]
    return ceil(needs[0].get(robot.pose, NEVER))
