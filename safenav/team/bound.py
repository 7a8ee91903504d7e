"""Lower bounds on the times of resolutions and rounds: the only proof that a deadline cannot be
met.

A relaxation (h_max): robots do not collide, are never busy, and each obstacle opens at its own
earliest time. Turn ``tick * n + i`` is that of robot ``i`` of ``n`` in a tick; a step that begins
in tick t and takes d ticks ends in the robot's turn of tick t + d - 1.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence

from msgspec import Struct

from safenav.team.state import Is, Stage, State
from safenav.team.team import Need, Obstacle, Team
from safenav.world.poses import FAR, Mask, PoseGraph, bits

NEVER = 1 << 40


class BoundRobot(Struct, frozen=True, eq=False):
    """State of a robot: in ``pose`` from the end of tick ``ready`` on; ``ticks``: duration of its
    fastest step. ``walls``: the poses that are closed to it permanently. ``leaves``: the pose from
    which a robot in transit departed; it can act there until it arrives, in tick ``until`` at the
    latest."""

    graph: PoseGraph
    pose: int
    ready: int
    ticks: int
    capabilities: frozenset[str]
    walls: Mask = 0
    leaves: int | None = None
    until: int = 0


class BoundObstacle(Struct, frozen=True):
    """State of an open obstacle."""

    gate: Obstacle
    stage: Stage = Stage()


class BoundMoment(Struct, frozen=True):
    """State of robots and open obstacles after turn ``now``."""

    walkers: tuple[BoundRobot, ...]
    opens: tuple[BoundObstacle, ...]
    now: int

    @property
    def count(self) -> int:
        return len(self.walkers)


def moment_of(team: Team, state: State, had_turn: int) -> BoundMoment:
    """Return the state after the turns of the first ``had_turn`` robots in the present tick.

    Obstacles that will disappear are ignored, and robots out of service count as in service: this
    only lowers the bounds.
    """
    tick = int(state.time)
    walkers = []
    for i, (member, robot) in enumerate(zip(team.members, state.robots, strict=True)):
        ready, leaves, until = tick - (i >= had_turn), None, 0
        if robot.to is not None:
            leaves = robot.pose
            ready = until = max(ready + 1, robot.due or 0)
        gone = [team.obstacles[k] for k in state.sealed if team.obstacles[k].source.goes is None]
        walls = member.graph.on(each.region for each in gone if i in each.blocks)
        skills = member.robot.capabilities
        walkers.append(
            BoundRobot(member.graph, robot.next, ready, member.ticks, skills, walls, leaves, until)
        )
    opens = (BoundObstacle(team.obstacles[k], state.obstacles[k].stage) for k in gates(team, state))
    return BoundMoment(tuple(walkers), tuple(opens), tick * len(walkers) + had_turn - 1)


def gates(team: Team, state: State) -> list[int]:
    """Return the open obstacles that a bound knows."""
    open_ = (k for k in state.requests if state.obstacles[k].state is Is.OPEN)
    return [k for k in open_ if team.obstacles[k].source.goes is None]


Times = tuple[tuple[int, ...], ...]
"""For each open obstacle the earliest turn in which each of its needs can be met."""


def earliest(moment: BoundMoment) -> Times:
    """Return the earliest turns of all needs: the fixpoint in which each obstacle opens as early as
    the times of the others allow."""
    times: Times = tuple(
        (moment.now,) * one.stage.need + (NEVER,) * (len(one.gate.needs) - one.stage.need)
        for one in moment.opens
    )
    while True:
        spreads = [Spread(moment, i, times) for i in range(moment.count)]
        after = tuple(
            tuple(map(min, _needs(moment, one, spreads), before))
            for one, before in zip(moment.opens, times, strict=True)
        )
        if after == times:
            return times
        times = after


def tick_of(turn: int, count: int) -> int | None:
    """Return the tick of a turn; None for NEVER."""
    return None if turn >= NEVER else turn // count


def own_turn(turn: int, robot: int, count: int) -> int:
    """Return the robot's first turn at or after a turn."""
    return turn + (robot - turn) % count


def still(turn: int, robot: int, count: int, ticks: int) -> int:
    """Return the tick after which a robot may depart and still act at its departure pose in a given
    turn: it can until it arrives, also in a group."""
    return (turn - robot) // count + 1 - ticks


class Spread:
    """Computes the poses of a robot by tick if obstacles open at their ``times``."""

    def __init__(self, moment: BoundMoment, robot: int, times: Times) -> None:
        self.walker, self.robot, self.count = moment.walkers[robot], robot, moment.count
        self._gates: list[tuple[Mask, int]] = []  # closed poses, and the first tick without them
        for one, turns in zip(moment.opens, times, strict=True):
            opens = _opens(one, robot, turns)
            if opens is not None:
                first = NEVER if opens >= NEVER else (opens - robot) // self.count + 1
                self._gates.append((self.walker.graph.poses_on(1 << one.gate.region), first))

    def field(self, seeds: Mapping[int, Mask]) -> ReachByTick:
        """Return its poses by tick if it may be in those of ``seeds`` from the end of their ticks
        on."""
        first, last, d = min(seeds), max(seeds), self.walker.ticks
        last = max([last, *(gate for _, gate in self._gates if gate < NEVER)])
        masks = [seeds[first]]
        quiet = 0
        while quiet <= d or first + len(masks) <= last + d:
            tick = first + len(masks)
            here = masks[-1] | seeds.get(tick, 0) | self._arriving(tick, first, masks)
            quiet = quiet + 1 if here == masks[-1] else 0
            masks.append(here)
        return ReachByTick(first, masks)

    def _arriving(self, tick: int, first: int, masks: Sequence[Mask]) -> Mask:
        """Return the poses in which its steps can end in a tick."""
        go = tick - self.walker.ticks + 1
        if go <= first:
            return 0
        return self.walker.graph.forward(masks[go - 1 - first]) & ~self._closed(go)

    def counted(self, field: ReachByTick, goal: Mask) -> dict[int, Mask]:
        """Return the poses of ``goal`` in which it may have had a turn by the end of each tick: by
        staying or arriving there, not by starting there at that tick."""
        found: dict[int, Mask] = {}
        before = 0
        for k in range(1, len(field.masks)):
            tick = field.first + k
            here = field.masks[k - 1] | self._arriving(tick, field.first, field.masks)
            if here & goal != before:
                before = found[tick] = here & goal
        return found

    def _closed(self, go: int) -> Mask:
        closed = self.walker.walls
        for poses, first in self._gates:
            if go < first:
                closed |= poses
        return closed

    def leaving(self, part: Need, since: int) -> int:
        """Return the first turn from ``since`` on in which it can take part in a need at its
        departure pose, before it arrives; NEVER if there is none."""
        walker = self.walker
        if walker.leaves is None or not part.regions >> walker.leaves % walker.graph.size & 1:
            return NEVER
        turn = since if part.together else own_turn(since, self.robot, self.count)
        return turn if turn < walker.until * self.count + self.robot else NEVER

    def start(self) -> dict[int, Mask]:
        return {self.walker.ready: 1 << self.walker.pose}


class ReachByTick:
    """Reachable poses of a robot by tick; the sets only grow, since waiting is always allowed."""

    def __init__(self, first: int, masks: Sequence[Mask]) -> None:
        self.first, self.masks = first, masks

    def contact(self, goal: Mask) -> int:
        """Return the first tick at whose end it may be in a pose of ``goal``."""
        for k, mask in enumerate(self.masks):
            if mask & goal:
                return self.first + k
        return NEVER

    def on(self, goal: Mask, since: int) -> dict[int, Mask]:
        """Return the poses of ``goal`` by tick; those from before tick ``since`` count for that
        tick."""
        found: dict[int, Mask] = {}
        before = 0
        for k, mask in enumerate(self.masks):
            tick = max(self.first + k, since)
            if mask & goal != before:
                before = found[tick] = mask & goal
        return found


def _opens(one: BoundObstacle, robot: int, turns: Sequence[int]) -> int | None:
    """Return the turn after which an obstacle no longer blocks a robot; None if it does not block
    it now."""
    first = one.stage.need
    for number in range(first, len(one.gate.needs)):
        if robot not in one.gate.closed_to[number]:
            return turns[number - 1] if number > first else None
    return turns[-1]


def _needs(moment: BoundMoment, one: BoundObstacle, spreads: Sequence[Spread]) -> list[int]:
    """Return the earliest turn of each need, in sequence; for needs that are already met, the
    present turn."""
    found = [moment.now] * one.stage.need
    previous: Mapping[int, ReachByTick] = {}
    before = moment.now + 1
    parts, stage, done = one.gate.needs, one.stage.need, one.stage.done
    for number in range(stage, len(parts)):
        # Needs may be met in sequence in one turn, the first one not before the next turn.
        part = parts[number]
        begun, before = before, found[-1] if number > stage else moment.now + 1
        if before >= NEVER:
            return found + [NEVER] * (len(parts) - number)
        turns, fields = [], dict[int, ReachByTick]()
        for robot, spread in enumerate(spreads):
            if not part.skills <= spread.walker.capabilities:
                continue
            field = _field(one, number, spread, (begun, before), previous)
            if field is not None:
                fields[robot] = field
                turn = min(_meets(spread, field, part, before), spread.leaving(part, before))
                turns += [turn] if turn < NEVER else []
        if number == stage and done and number + 1 < len(parts):
            for robot in done:
                fields[robot] = spreads[robot].field(spreads[robot].start())
        previous = fields
        missing = part.robots - (len(done) if number == stage else 0)
        turns.sort()
        met = turns[missing - 1] if len(turns) >= missing > 0 else NEVER
        found.append(met if missing > 0 else before)
    return found


def _field(
    one: BoundObstacle,
    number: int,
    spread: Spread,
    since: tuple[int, int],
    previous: Mapping[int, ReachByTick],
) -> ReachByTick | None:
    """Return the poses, by tick, of a robot that takes part in a need; None if it cannot.
    ``since``: the turns from which the previous need and this one can be met; ``previous``: the
    poses of the robots that took part in the previous need."""
    robot, walker, first = spread.robot, spread.walker, number == one.stage.need
    (begun, before), group = since, one.stage.group
    if first and (robot in one.stage.done or (group is not None and robot not in group)):
        return None  # it has done its part, or others are to
    if first or not one.gate.needs[number].same:
        return spread.field(spread.start())
    former = one.gate.needs[number - 1]
    if robot not in previous:
        return None
    # if it acts alone, it may have left long before the need is fulfilled
    part_at = before if former.together else own_turn(begun, robot, spread.count)
    left = still(part_at, robot, spread.count, walker.ticks)
    had = previous[robot].on(walker.graph.poses_on(former.regions), left)
    took_part = number - 1 == one.stage.need and robot in one.stage.done
    if took_part or spread.leaving(former, part_at) < NEVER:
        had = spread.start()
    return spread.field(had) if had else None


def _meets(spread: Spread, field: ReachByTick, part: Need, before: int) -> int:
    """Return the first turn, from ``before`` on, in which a robot can take part in a need."""
    tick = field.contact(spread.walker.graph.poses_on(part.regions))
    if tick >= NEVER:
        return NEVER
    turn = max(tick * spread.count + spread.robot, before)
    return turn if part.together else own_turn(turn, spread.robot, spread.count)


def rounds_done(moment: BoundMoment, robot: int, times: Times, goals: Iterable[Mask]) -> int:
    """Return the earliest tick at whose end a robot can have met ``goals`` in sequence, each in a
    separate turn; NEVER if it cannot."""
    spread = Spread(moment, robot, times)
    seeds, walker = spread.start(), spread.walker
    arrives = walker.leaves is not None
    for goal in goals:
        field = spread.field(seeds)
        met = spread.counted(field, goal)
        if arrives and goal >> walker.pose & 1:
            met = {walker.ready: 1 << walker.pose, **met}  # it arrives at its target
        arrives = False
        if not met:
            return NEVER
        seeds = met
    return min(seeds)


# Rounds of at most N ticks, forever, by one robot alone: exact, and without a counter.
#
# K is the greatest set of poses of the last target from which another round of at most N ticks
# leads back into K; the robot can meet the deadline forever iff its first round leads into K in
# time.


Costs = Mapping[int, int]
"""The steps to each pose."""


class Walk(Struct, frozen=True, eq=False):
    """A robot's rounds: its ``targets`` as pose masks, met in turn, inside ``allowed`` poses;
    ``ticks`` of each step; its start. ``strict``: the other targets are not touched on the way (the
    paper's patrol)."""

    graph: PoseGraph
    targets: tuple[Mask, ...]
    allowed: Mask
    start: int
    ticks: int = 1
    strict: bool = False


def least_within(walk: Walk) -> int | None:
    """Return the least N such that every round can take at most N ticks; None if there is none."""
    costs, begin = _rounds(walk), _leg(walk, {walk.start: 0})
    values = sorted({*begin.values(), *(c for row in costs.values() for c in row.values())})
    least = bisect_left(values, True, key=lambda most: bool(_kept(costs, begin, most)))
    return values[least] if least < len(values) else None


def _kept(costs: Mapping[int, Costs], begin: Costs, most: int) -> set[int]:
    """Return K if the first round leads into it in time, else the empty set."""
    lasting = set(costs)
    while True:
        after = {p for p in lasting if any(c <= most and q in lasting for q, c in costs[p].items())}
        if after == lasting:
            break
        lasting = after
    return lasting if any(c <= most and p in lasting for p, c in begin.items()) else set()


def _rounds(walk: Walk) -> dict[int, Costs]:
    """Return the ticks of the fastest round between poses of the last target."""
    return {
        pose: found
        for pose in bits(walk.targets[-1] & walk.allowed)
        if (found := _leg(walk, {pose: 0}))
    }


def _leg(walk: Walk, at: Costs) -> Costs:
    """Return the ticks to each pose of the last target through all targets."""
    for index in range(len(walk.targets)):
        at = _meet(walk, at, index)
    return at


def _meet(walk: Walk, at: Costs, index: int) -> dict[int, int]:
    """Return the ticks to each pose of a target that is met in a later tick than the previous one:
    by steps, or by staying for a tick. A target is met in the pose in which it is entered: no path
    leads through it."""
    if not at:
        return {}
    graph, goal, allowed = walk.graph, walk.targets[index] & walk.allowed, walk.allowed
    if walk.strict:
        for other, target in enumerate(walk.targets):
            allowed &= ~target if other != index else allowed
    layers: dict[int, Mask] = {}
    for pose, cost in at.items():
        layers[cost] = layers.get(cost, 0) | 1 << pose
    found: dict[int, int] = {}
    for pose, cost in at.items():
        if goal >> pose & 1:
            found[pose] = min(found.get(pose, FAR), cost + 1)
    seen, waiting = 0, layers
    while waiting:
        cost = min(waiting)
        frontier = waiting.pop(cost) & ~seen
        seen |= frontier
        step = graph.forward(frontier) & allowed
        for pose in bits(step & goal):
            found[pose] = min(found.get(pose, FAR), cost + walk.ticks)
        step &= ~seen & ~goal
        if step:
            waiting[cost + walk.ticks] = waiting.get(cost + walk.ticks, 0) | step
    return found
