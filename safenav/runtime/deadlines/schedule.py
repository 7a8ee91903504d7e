"""Search for acts that resolve requests in time: exact except for collisions.

A search over acts in the order of their turns; between two acts each robot takes the fastest path.
Below a node no obstacle opens before its lower bound (``bound``): nodes beyond a due turn are
pruned. Further resolutions delay nothing, so a robot may act wherever it passes; it takes loads
only as the acts require (docs/scenario.md, Loads).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations, product

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.runtime.deadlines import bound
from safenav.runtime.resolution.problem import BudgetExhaustedError
from safenav.world.poses import Mask

BUDGET = 400
"""Nodes of all searches from one state; in campaigns they needed at most 197."""


class TimedAct(Struct, frozen=True):
    """The robots of ``group`` take part in a need of an open obstacle in a turn, each in its pose;
    ``came``: the tick at whose end it is there (None: it has departed from that pose, and arrives
    elsewhere only after that turn)."""

    turn: int
    gate: int
    need: int
    group: tuple[int, ...]
    poses: tuple[int, ...]
    came: tuple[int | None, ...]


Acts = tuple[TimedAct, ...]


class Spot(Struct, frozen=True):
    """A pose in which a robot can act from a turn on; ``came`` as in ``TimedAct``."""

    pose: int
    came: int | None
    turn: int


class Scheduler(Struct, eq=False):
    """Searches from one state. ``conflicts``: for each robot those with which it never shares a
    region; ``barred``: for each obstacle the robots that cannot serve it; ``allowed``: whether the
    team can continue after some acts; ``stays``: robots depart for the next act only when one is
    over, as in a run; ``budget``: nodes, by default ``BUDGET``."""

    moment: bound.BoundMoment
    conflicts: Sequence[frozenset[int]]
    barred: Sequence[frozenset[int]] = ()
    allowed: Callable[[Acts], bool] = lambda _: True
    stays: bool = False
    budget: int | None = None
    _fields: bound.Fields = field(default_factory=dict)
    _nodes: int = 0

    def soonest(self, gate: int, due: Mapping[int, int] | None = None) -> tuple[int, Acts]:
        """Return the first turn in which an obstacle can be resolved (NEVER if none) while those of
        ``due`` are resolved by theirs, and the acts. Raises BudgetExhaustedError."""
        found: Acts = ()
        turn = bound.NEVER
        while True:
            better = self.in_time({**(due or {}), gate: turn - 1})
            if better is None:
                return turn, found
            turn, found = max(act.turn for act in better if act.gate == gate), better

    def begin_again(self) -> None:
        """Restore the whole budget."""
        self._nodes = 0

    def in_time(self, due: Mapping[int, int]) -> Acts | None:
        """Return acts that resolve each obstacle of ``due`` by its turn; None if there are none.
        Raises BudgetExhaustedError."""
        return self._search(self.moment, (), due, set())

    def _search(
        self, moment: bound.BoundMoment, done: Acts, due: Mapping[int, int], seen: set[object]
    ) -> Acts | None:
        if all(moment.opens[gate].over for gate in due):
            return done
        key = moment.walkers, moment.opens
        if key in seen:
            return None
        seen.add(key)
        self._nodes += 1
        if self._nodes > (BUDGET if self.budget is None else self.budget):
            raise BudgetExhaustedError
        times = bound.earliest(moment, self._fields)
        if any(times[gate][-1] > turn for gate, turn in due.items()):
            return None
        last = done[-1].turn if done else moment.now
        options = [act for act in self._acts(moment) if last <= act.turn]
        options.sort(key=lambda act: (due.get(act.gate, bound.NEVER), act.turn, act.group))
        for act in options:
            if act.turn > due.get(act.gate, bound.NEVER - 1) or not self.allowed((*done, act)):
                continue
            found = self._search(_after(moment, act, stays=self.stays), (*done, act), due, seen)
            if found is not None:
                return found
        return None

    def _acts(self, moment: bound.BoundMoment) -> Iterator[TimedAct]:
        """Yield the possible next acts, each at its earliest turn."""
        spreads = [
            bound.Spread(moment, i, bound.known(moment), self._fields) for i in range(moment.count)
        ]
        fields = [spread.field(spread.start()) for spread in spreads]
        for gate, one in enumerate(moment.opens):
            if one.over:
                continue
            part, next_ = one.next, _since(moment, gate)
            spots: dict[int, list[Spot]] = {}
            for robot in self._able(moment, gate):
                walker = moment.walkers[robot]
                goal, n = walker.graph.poses_on(part.regions), moment.count
                since = max(next_, walker.unloaded) if one.takes else next_
                found = fields[robot].arrivals(goal)
                spots[robot] = [
                    Spot(pose, tick, max(tick * n + robot, since)) for pose, tick in found
                ]
                if walker.leaves is not None and spreads[robot].leaving(part, since) < bound.NEVER:
                    spots[robot].insert(0, Spot(walker.leaves, None, since))
            if part.together:
                yield from self._together(moment, gate, spots)
                continue
            for robot, places in spots.items():
                for spot in places:
                    turn = bound.own_turn(spot.turn, robot, moment.count)
                    here = (robot,), (spot.pose,), (spot.came,)
                    yield TimedAct(turn, gate, one.stage.need, *here)

    def _able(self, moment: bound.BoundMoment, gate: int) -> list[int]:
        """Return the robots that can still take part in the next need of an obstacle."""
        one, out = moment.opens[gate], self.barred[gate] if self.barred else frozenset[int]()
        out |= _full(moment) if one.takes else frozenset()
        out |= one.gate.cut_off_at(one.stage.need)
        skills = one.gate.skills[one.stage.need]
        return [
            robot
            for robot, walker in enumerate(moment.walkers)
            if robot not in out and skills <= walker.capabilities and one.open_to(robot)
        ]

    def _together(
        self, moment: bound.BoundMoment, gate: int, spots: Mapping[int, list[Spot]]
    ) -> Iterator[TimedAct]:
        one, since = moment.opens[gate], _since(moment, gate)
        fewest = one.next.robots
        then = one.gate.needs[one.stage.need + 1 : one.stage.need + 2]
        # All robots that are there take part (in taking a load only as many as it needs). If the
        # same robots must meet the next need, which of them do is a choice.
        most = len(spots) if then and then[0].same and not one.takes else fewest
        sizes = range(fewest, most + 1)
        for group in (group for size in sizes for group in combinations(spots, size)):
            for places in product(*(spots[robot] for robot in group)):
                at = [
                    (robot, spot.pose % moment.walkers[robot].graph.size)
                    for robot, spot in zip(group, places, strict=True)
                ]
                if any(b in self.conflicts[a] and p == q for (a, p), (b, q) in combinations(at, 2)):
                    continue
                there = max(since, *(spot.turn for spot in places))
                turn = min(bound.own_turn(there, robot, moment.count) for robot in group)
                until = [
                    moment.walkers[robot].until * moment.count + robot
                    for robot, spot in zip(group, places, strict=True)
                    if spot.came is None
                ]
                if any(turn >= arrival for arrival in until):
                    continue
                poses, came = tuple(s.pose for s in places), tuple(s.came for s in places)
                yield TimedAct(turn, gate, one.stage.need, group, poses, came)


def _full(moment: bound.BoundMoment) -> frozenset[int]:
    """Return the robots that carry as many loads as they can."""
    loads = [robot for one in moment.opens for robot in one.gate.carriers(one.stage)]
    return frozenset(i for i, w in enumerate(moment.walkers) if loads.count(i) >= w.room)


def possible(moment: bound.BoundMoment, acts: Acts) -> bool:
    """Return whether acts chosen in another state of the same robots are still possible."""
    return all(
        spread.field(spread.start()).contact(1 << pose) <= came
        for spread, pose, came in _journeys(moment, acts)
    )


def leads_through(moment: bound.BoundMoment, acts: Acts, regions: Sequence[Mask]) -> bool:
    """Return whether a fastest path of a robot to the region of one of its acts enters ``regions``
    (given for each robot). Strategies may arrive there with any heading."""
    for spread, pose, came in _journeys(moment, acts):
        walker, field = spread.walker, spread.field(spread.start())
        closed = walker.graph.poses_on(regions[spread.robot]) & ~(1 << walker.pose)
        there = walker.graph.poses_on(1 << pose % walker.graph.size)
        on_time = {came: there}  # the poses from which it still arrives in time, by tick
        for tick in reversed(range(field.first, came + 1)):
            after = on_time.get(tick + walker.ticks, 0)
            here = on_time.get(tick + 1, 0) | walker.graph.backward(after)
            on_time[tick] = (here | on_time.get(tick, 0)) & field.at(tick)
            if on_time[tick] & closed:
                return True
    return False


def _journeys(moment: bound.BoundMoment, acts: Acts) -> Iterator[tuple[bound.Spread, int, int]]:
    """Yield for each act and robot its possible poses before the act, its pose in it, and the tick
    at whose end it arrives."""
    for act in acts:
        for robot, pose, came in zip(act.group, act.poses, act.came, strict=True):
            if came is not None:
                yield bound.Spread(moment, robot, bound.known(moment)), pose, came
        moment = _after(moment, act, stays=True)


def _since(moment: bound.BoundMoment, gate: int) -> int:
    """Return the first turn in which the next need of an obstacle can be met."""
    one = moment.opens[gate]
    return one.met[-1] if one.met else moment.now + 1


def _after(moment: bound.BoundMoment, act: TimedAct, *, stays: bool) -> bound.BoundMoment:
    """Return the state after an act; a robot may already have departed (unless it ``stays``) and
    arrive later."""
    walkers, opens, count = list(moment.walkers), list(moment.opens), moment.count
    one, full = opens[act.gate], _full(moment)
    for robot, pose, came in zip(act.group, act.poses, act.came, strict=True):
        if came is None:
            continue
        ticks = 1 if stays else walkers[robot].ticks
        ready = max(came, bound.still(act.turn, robot, count, ticks))
        walkers[robot] = replace(walkers[robot], pose=pose, ready=ready, leaves=None)
    stage = one.gate.acted(one.stage, act.group)
    met = (*one.met, act.turn) if stage.need > one.stage.need else one.met
    opens[act.gate] = replace(one, stage=stage, met=met)
    after = bound.BoundMoment(tuple(walkers), tuple(opens), moment.now)
    if full <= _full(after):
        return after
    for robot in full - _full(after):
        walkers[robot] = replace(walkers[robot], unloaded=act.turn)
    return replace(after, walkers=tuple(walkers))
