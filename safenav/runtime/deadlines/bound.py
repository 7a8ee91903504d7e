"""Lower bounds on the times of resolutions and rounds: the only proof that a promise is lost.

A relaxation (h_max): robots do not collide, are never busy, and each obstacle opens at its own
earliest time. Turn ``tick * n + i`` is that of robot ``i`` of ``n`` in a tick; a step that is begun
in tick t and takes d ticks ends in the turn of tick t + d - 1.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from msgspec import Struct

from safenav.runtime.resolution.problem import OpenNeed, OpenObstacle, Stage
from safenav.world.poses import Mask, PoseGraph, bits

NEVER = 1 << 40


class BoundRobot(Struct, frozen=True, eq=False):
    """A robot at a moment: in ``pose`` from the end of tick ``ready`` on; ``ticks``: of its fastest
    step. ``walls``: the poses that are closed to it permanently. ``leaves``: the pose from which a
    robot in transit departed; it can act there until it arrives, in tick ``until`` at the latest.
    ``room``: the most loads that it can carry, which bounds ignore; ``unloaded``: the turn to come
    in which it puts one down, having had no room before."""

    graph: PoseGraph
    pose: int
    ready: int
    ticks: int
    capabilities: frozenset[str]
    walls: Mask = 0
    leaves: int | None = None
    until: int = 0
    room: int = 1
    unloaded: int = 0


class BoundObstacle(Struct, frozen=True):
    """An open obstacle, as far as it is resolved. ``met``: the turns to come in which the last
    needs before its stage are met. ``sequential``: the robots of a later need set out when the one
    before it is met."""

    gate: OpenObstacle
    stage: Stage = Stage()
    met: tuple[int, ...] = ()
    sequential: bool = False

    @property
    def over(self) -> bool:
        return self.gate.resolved(self.stage)

    @property
    def next(self) -> OpenNeed:
        return self.gate.needs[self.stage.need]

    def open_to(self, robot: int) -> bool:
        """Whether a robot may have its part in the next need, and has not had it."""
        group = self.stage.group
        return robot not in self.stage.done and (group is None or robot in group)

    @property
    def takes(self) -> bool:
        """Whether the robots that meet the next need carry a load from then on."""
        return self.gate.takes(self.stage)

    def turns(self, now: int) -> list[int]:
        """The turns of the needs before its stage."""
        return [*[now] * (self.stage.need - len(self.met)), *self.met]


class BoundMoment(Struct, frozen=True):
    """State of robots and open obstacles after turn ``now``."""

    walkers: tuple[BoundRobot, ...]
    opens: tuple[BoundObstacle, ...]
    now: int

    @property
    def count(self) -> int:
        return len(self.walkers)


Times = tuple[tuple[int, ...], ...]
"""For each open obstacle the earliest turn in which each of its needs can be met."""


Fields = dict[tuple[object, ...], "ReachByTick"]
"""Where robots can be by tick, as computed before."""


def known(moment: BoundMoment) -> Times:
    """The turns of the needs that are met; NEVER for the others."""
    return tuple(
        (*one.turns(moment.now), *(NEVER,) * (len(one.gate.needs) - one.stage.need))
        for one in moment.opens
    )


def earliest(moment: BoundMoment, fields: Fields | None = None) -> Times:
    """The least fixpoint from above: each obstacle's needs at their earliest, if the others are
    met at theirs. ``fields``: a memory for several questions about the same robots."""
    times, fields = known(moment), {} if fields is None else fields
    while True:
        spreads = [Spread(moment, i, times, fields) for i in range(moment.count)]
        after = tuple(
            tuple(map(min, _needs(moment, one, spreads), before))
            for one, before in zip(moment.opens, times, strict=True)
        )
        if after == times:
            return times
        times = after


def tick_of(turn: int, count: int) -> int | None:
    """The tick of a turn; None for never."""
    return None if turn >= NEVER else turn // count


def own_turn(turn: int, robot: int, count: int) -> int:
    """The first turn of a robot from that one on."""
    return turn + (robot - turn) % count


def still(turn: int, robot: int, count: int, ticks: int) -> int:
    """The tick after which a robot may set out, and yet be in a turn where it was: until it has
    arrived elsewhere, it acts there, and others may count it in."""
    return (turn - robot) // count + 1 - ticks


class Spread:
    """The poses of a robot by tick, obstacles being open from their ``times`` on."""

    def __init__(
        self, moment: BoundMoment, robot: int, times: Times, fields: Fields | None = None
    ) -> None:
        self.walker, self.robot, self.count = moment.walkers[robot], robot, moment.count
        self._fields = {} if fields is None else fields
        self._gates: list[tuple[Mask, int]] = []  # closed poses, and the first tick without them
        for one, turns in zip(moment.opens, times, strict=True):
            opens = _opens(one, robot, turns)
            if opens is not None:
                first = NEVER if opens >= NEVER else (opens - robot) // self.count + 1
                self._gates.append((self.walker.graph.poses_on(1 << one.gate.region), first))

    def field(self, seeds: Mapping[int, Mask]) -> ReachByTick:
        """Its poses by tick, if it may be in those of ``seeds`` from the end of their ticks on."""
        begun = min(seeds) + 1  # what is open then never stopped it
        gates = [gate for gate in self._gates if gate[1] > begun]
        key = (self.robot, *sorted(seeds.items()), None, *gates)
        found = self._fields.get(key)
        if found is None:
            found = self._fields[key] = self._field(seeds)
        return found

    def _field(self, seeds: Mapping[int, Mask]) -> ReachByTick:
        graph, d = self.walker.graph, self.walker.ticks
        first, last = min(seeds), max(seeds)
        last = max([last, *(gate for _, gate in self._gates if gate < NEVER)])
        masks = [seeds[first]]
        quiet = 0
        while quiet <= d or first + len(masks) <= last + d:
            tick = first + len(masks)
            go = tick - d + 1
            here = masks[-1] | seeds.get(tick, 0)
            if go > first:
                here |= graph.forward(masks[go - 1 - first]) & ~self._closed(go)
            quiet = quiet + 1 if here == masks[-1] else 0
            masks.append(here)
        return ReachByTick(first, masks)

    def counted(self, field: ReachByTick, goal: Mask) -> dict[int, Mask]:
        """The poses of ``goal`` in which it may have had a turn by the end of each tick: staying
        there or arriving, not where it only begins at that tick."""
        graph, d = self.walker.graph, self.walker.ticks
        found: dict[int, Mask] = {}
        before = 0
        for k in range(1, len(field.masks)):
            tick = field.first + k
            go = tick - d + 1
            here = field.masks[k - 1]
            if go > field.first:
                here |= graph.forward(field.masks[go - 1 - field.first]) & ~self._closed(go)
            if here & goal != before:
                before = found[tick] = here & goal
        return found

    def _closed(self, go: int) -> Mask:
        closed = self.walker.walls
        for poses, first in self._gates:
            if go < first:
                closed |= poses
        return closed

    def leaving(self, part: OpenNeed, since: int) -> int:
        """The first turn from ``since`` on in which it can have its part in a need where it set
        out, before it arrives; NEVER if there is none."""
        walker = self.walker
        if walker.leaves is None or not part.regions >> walker.leaves % walker.graph.size & 1:
            return NEVER
        turn = since if part.together else own_turn(since, self.robot, self.count)
        return turn if turn < walker.until * self.count + self.robot else NEVER

    def start(self) -> dict[int, Mask]:
        return {self.walker.ready: 1 << self.walker.pose}


class ReachByTick:
    """Poses of a robot by tick: they only grow, since waiting is always allowed."""

    def __init__(self, first: int, masks: Sequence[Mask]) -> None:
        self.first, self.masks = first, masks

    def at(self, tick: int) -> Mask:
        """The poses in which it may be at the end of a tick from the first one on."""
        return self.masks[min(tick - self.first, len(self.masks) - 1)]

    def contact(self, goal: Mask) -> int:
        """The first tick at whose end it may be in a pose of ``goal``."""
        for k, mask in enumerate(self.masks):
            if mask & goal:
                return self.first + k
        return NEVER

    def arrivals(self, goal: Mask) -> list[tuple[int, int]]:
        """The poses of ``goal``, each with the first tick at whose end it may be there."""
        found, seen = [], 0
        for k, mask in enumerate(self.masks):
            fresh = mask & goal & ~seen
            if fresh:
                found += [(pose, self.first + k) for pose in bits(fresh)]
                seen |= fresh
        return found

    def on(self, goal: Mask, since: int) -> dict[int, Mask]:
        """The poses of ``goal`` by tick, those before tick ``since`` at that one."""
        found: dict[int, Mask] = {}
        before = 0
        for k, mask in enumerate(self.masks):
            tick = max(self.first + k, since)
            if mask & goal != before:
                before = found[tick] = mask & goal
        return found


def _opens(one: BoundObstacle, robot: int, turns: Sequence[int]) -> int | None:
    """The turn after which an obstacle no longer stops a robot; None if it does not now."""
    first = one.stage.need - len(one.met)
    for number in range(first, len(one.gate.needs)):
        if robot not in one.gate.closed_to[number]:
            return turns[number - 1] if number > first else None
    return turns[-1]


def _needs(moment: BoundMoment, one: BoundObstacle, spreads: Sequence[Spread]) -> list[int]:
    """The earliest turn of each need, met one after the other; those that are met: now."""
    found = one.turns(moment.now)
    previous: Mapping[int, ReachByTick] = {}
    before = moment.now + 1
    parts, stage, done = one.gate.needs, one.stage.need, one.stage.done
    for number in range(stage, len(parts)):
        # Needs may be met one after the other in one turn, the next one not before the next turn.
        part = parts[number]
        begun, before = before, found[-1] if one.met or number > stage else moment.now + 1
        if before >= NEVER:
            return found + [NEVER] * (len(parts) - number)
        turns, fields = [], dict[int, ReachByTick]()
        for robot, spread in enumerate(spreads):
            if not one.gate.skills[number] <= spread.walker.capabilities:
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
    """Where a robot may be when it has its part in a need; None if it cannot have one. ``since``:
    the turns from which the need before and this one can be met; ``previous``: where robots were
    when they had their part in that before."""
    robot, walker, first = spread.robot, spread.walker, number == one.stage.need
    begun, before = since
    if first and not one.open_to(robot):
        return None
    if first or not (one.gate.needs[number].same or one.sequential):
        return spread.field(spread.start())
    former = one.gate.needs[number - 1]
    if not one.gate.needs[number].same:
        return spread.field(_when_met(spread, robot, before, previous, former))
    if robot not in previous:
        return None
    # alone, it may have left long before that is met
    part_at = before if former.together else own_turn(begun, robot, spread.count)
    left = still(part_at, robot, spread.count, walker.ticks)
    had = previous[robot].on(walker.graph.poses_on(former.regions), left)
    took_part = number - 1 == one.stage.need and robot in one.stage.done
    if took_part or spread.leaving(former, part_at) < NEVER:
        had = spread.start()
    return spread.field(had) if had else None


def _meets(spread: Spread, field: ReachByTick, part: OpenNeed, before: int) -> int:
    """The first turn, from ``before`` on, in which a robot can have its part in a need."""
    tick = field.contact(spread.walker.graph.poses_on(part.regions))
    if tick >= NEVER:
        return NEVER
    turn = max(tick * spread.count + spread.robot, before)
    return turn if part.together else own_turn(turn, spread.robot, spread.count)


def _when_met(
    spread: Spread, robot: int, turn: int, fields: Mapping[int, ReachByTick], need: OpenNeed
) -> dict[int, Mask]:
    """Where a robot may be, by tick, once a need is met in a turn: where it was before, or where it
    had its part in that."""
    walker = spread.walker
    first = max(walker.ready, (turn - robot) // spread.count)
    had = fields[robot].on(walker.graph.poses_on(need.regions), first) if robot in fields else {}
    alone = need.together or need.robots == 1  # else it may have left since
    if had and alone and len(fields) == need.robots:
        return had  # it had its part: no other robot could
    return {first: 1 << walker.pose | had.pop(first, 0), **had}


def rounds_done(moment: BoundMoment, robot: int, times: Times, goals: Iterable[Mask]) -> int:
    """The earliest tick at whose end a robot can have met ``goals`` one after the other, each in a
    turn of its own; NEVER if it cannot."""
    spread = Spread(moment, robot, times)
    seeds, walker = spread.start(), spread.walker
    arrives = walker.leaves is not None
    for goal in goals:
        field = spread.field(seeds)
        met = spread.counted(field, goal)
        if arrives and goal >> walker.pose & 1:
            met = {walker.ready: 1 << walker.pose, **met}  # it arrives in its target
        arrives = False
        if not met:
            return NEVER
        seeds = met
    return min(seeds)
