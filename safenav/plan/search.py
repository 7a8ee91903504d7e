"""LaCAM (Okumura, AAAI 2023): a plan for the whole remaining mission, or an infeasibility proof.

The search is depth first over joint states. The next state is PIBT's proposal, then PIBT's with one
robot forced, then each step of a single robot, so the search is complete with few edges per state.
Many short searches in different orders find shorter plans than one deep search. If the floor is
full, chains of legs for one robot find a plan.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import chain, islice
from random import Random

from safenav.team.floor import Floor, Joint, Stages
from safenav.world.poses import FAR, Mask

Guide = Callable[[Stages, tuple[int, ...]], Sequence[Mask | None]]
"""The poses to which duties send each robot (0: nowhere; None: its own next target)."""
Goal = Callable[[Joint], bool]

ORDERS = FARTHEST, STATIC, ONE = "farthest first", "a random order", "one goal at a time"
DUTIES = "farthest first; robots without a duty rest until all are fulfilled"
"""Duties first, since a resolution restarts all rounds: goals met before do not count."""
MANY, ROLLS, MOST_OF_A_ROLL, PACED, SLOWEST = 60, 8, 2, 4, 20
FIRST_BUDGET, MOST_OF_AN_ORDER, ROUNDS = 200, 800, 7
FEWEST, SINGLES, PROOF, PROOF_TURN = 4, 4_000, 60_000, 2
LEG, CHAIN, LEGS = 8, 4_000, 50
EXTRA, TRIES = 20_000, 3


class Exhausted(list[Joint]):
    """The result of a complete search: all reachable joint states, none of which is a goal."""


Answer = list[Joint] | Exhausted | None
"""The joint states of a plan; a proof; or None if the budget is exhausted."""


class Search:
    """A search for a plan. ``work``: maximum number of single-robot steps that it examines, at
    about 200,000 per second. ``check`` raises if the search must end."""

    def __init__(
        self,
        floor: Floor,
        served: frozenset[int],
        guide: Guide,
        start: Joint,
        seed: int,
        work: int,
        check: Callable[[], None] = lambda: None,
    ) -> None:
        self._check, self.work, self.random = check, work, Random(seed)
        self.floor, self.served, self.guide, self.start = floor, served, guide, start
        self._alive = [floor.live(i, floor.floors[i]) for i in range(len(start.poses))]
        alive = self._alive if len(floor.robots) > MANY else None
        self._propose = Proposals(floor, self.random, alive).propose
        self._guided: dict[Stages, Sequence[Mask | None]] = {}
        self._turn, self._begun = 0, False

    def goal(self, joint: Joint) -> bool:
        self._check()
        return completes(self.floor, joint, self.served)

    @cached_property
    def _depth(self) -> int:
        """The budget of the first search. A plan has at least as many states as the farthest robot
        has steps."""
        far = max(map(_distance, self.fields(self.start), self.start.poses), default=0)
        return max(FIRST_BUDGET, PACED * far)

    def first(self) -> Answer:
        """Return the result of the first search of ``run``, which then begins with the second."""
        if self.goal(self.start):
            return [self.start]
        how, self._begun = DUTIES if self.served else FARTHEST, True
        return self.deep(self.start, self.goal, self._depth, how, self._order(how))

    def run(self, until: int = ROUNDS) -> Answer:
        """Return a plan or proof; None if the budget is exhausted or round ``until`` is reached.
        Each round tries search methods from cheap to expensive. A further call continues with the
        next round."""
        if self.goal(self.start):
            return [self.start]
        few = len(self.floor.robots) <= FEWEST
        if not self._turn and len(self.floor.robots) > MANY:
            every = self._rolls([1] * len(self.start.poses), MOST_OF_A_ROLL * self.floor.team.size)
            if (found := next(every, None)) is not None:
                return found
        while self._turn < until and self.work > 0:
            turn, budget = self._turn, self._depth << self._turn
            self._turn += 1
            hows = (DUTIES, *ORDERS) if self.served else ORDERS
            for how in hows[self._begun and not turn :]:
                once = how in (DUTIES, FARTHEST)
                for _ in range(1 if once else max(1, budget // MOST_OF_AN_ORDER)):
                    states = budget if once else min(budget, MOST_OF_AN_ORDER)
                    found = self.deep(self.start, self.goal, states, how, self._order(how))
                    if isinstance(found, Exhausted):
                        return self.singles(PROOF if turn else SINGLES)
                    if found is not None:
                        return found
            most = SINGLES << 2 * turn if few and turn <= PROOF_TURN else 0
            if most and (answer := self.singles(most)) is not None:
                return answer
            for _ in range(turn + 1):
                if (found := self._legs(CHAIN << turn // 2)) is not None:
                    return found
        return self.singles(PROOF) if few and self._turn <= PROOF_TURN else None

    def alternatives(self, length: int) -> Iterator[list[Joint]]:
        """Yield alternatives to a plan with ``length`` states: plans that do not put duties first;
        for a few robots, plans of other searches; and plans in which fast robots do not wait for
        slow ones."""
        times, self.work = self.floor.team.step_times, EXTRA
        # Searches that ignore duties could plan help by robots that follow strategies.
        few = len(self.floor.robots) <= FEWEST and not (self.served and self.floor.team.lone)
        hows = [(FARTHEST, PACED * length)] * bool(self.served)
        hows += [(STATIC, length), (ONE, length)] * TRIES * few
        shortest = (self.singles(SINGLES // 4) for _ in range(few))
        deep = (self.deep(self.start, self.goal, n, how, self._order(how)) for how, n in hows)
        for found in chain(shortest, deep):
            yield from () if isinstance(found, Exhausted | None) else (found,)
        least = min(times[i] for i in self.floor.robots)
        periods = [min(SLOWEST, round(each / least)) for each in times]
        if max(periods[i] for i in self.floor.robots) > 1:
            yield from islice(self._rolls(periods, PACED * length), TRIES)

    def _rolls(self, periods: Sequence[int], most: int) -> Iterator[list[Joint]]:
        """Yield plans with at most ``most`` states, found by lifelong PIBT without backtracking:
        the robot that has waited longest for a goal chooses first. Robot i steps only every
        ``periods[i]`` ticks."""
        robots = self.floor.robots
        for _ in range(ROLLS):
            states, rank = [self.start], {i: self.random.random() for i in robots}
            tick = stood = 0
            while len(states) < most and self.work > 0:
                joint, tick = states[-1], tick + 1
                fields = self.fields(joint)
                for i in robots:
                    wants = _misses(fields[i], joint.poses[i])
                    rank[i] = rank[i] + 1 if wants else rank[i] % 1
                self.work -= len(robots)
                order = sorted(robots, key=lambda i: -rank[i])
                still = [(i, joint.poses[i]) for i in robots if tick % periods[i]]
                poses = self._propose(joint, fields, order, still)
                after = None if poses is None else self._reached(joint, poses)
                if after is None:
                    stood += 1
                    if stood < max(periods):
                        continue
                    poses = self._aside(joint)
                    after = None if poses is None else self._reached(joint, poses)
                    if after is None:
                        break
                stood = 0
                states.append(after)
                if self.goal(after):
                    yield states
                    break

    def _aside(self, joint: Joint) -> tuple[int, ...] | None:
        """Return the next poses if a random half of the robots only tries to leave its present
        poses; None if that is impossible."""
        order, fields = self._order(STATIC), list[Field]([None] * len(joint.poses))
        for i in order[: len(order) // 2]:
            away = [0] * (self.floor.team.size * self.floor.graphs[i].blocks)
            away[joint.poses[i]] = 1
            fields[i] = away
        return self._propose(joint, fields, order)

    def _order(self, how: str) -> list[int]:
        order = list(self.floor.robots)
        if how is not FARTHEST:
            self.random.shuffle(order)
        return order

    def singles(self, budget: int) -> Answer:
        """Search breadth first, by steps of single robots, for a shortest plan or a proof."""
        before: dict[Joint, Joint | None] = {self.start: None}
        queue = deque([self.start])
        if self.goal(self.start):
            return [self.start]
        while queue:
            joint = queue.popleft()
            for after in self._singles(joint):
                if self._new(after, before):
                    before[after] = joint
                    self.work -= 1
                    if self.goal(after):
                        return path(after, before)
                    queue.append(after)
            if len(before) > budget or self.work <= 0:
                return None
        return Exhausted(before)

    def deep(self, start: Joint, goal: Goal, budget: int, how: str, order: list[int]) -> Answer:
        """Search depth first, and examine at most ``budget`` states."""
        before: dict[Joint, Joint | None] = {start: None}
        stack = [(start, self._next(start, how, order))]
        edges = 0
        while stack:
            joint, following = stack[-1]
            after = next(following, None)
            if after is None:
                stack.pop()
                continue
            edges += 1
            if edges > budget * 12 or self.work <= 0:
                return None
            if self._new(after, before) and not (self.floor.one_way and jammed(self.floor, after)):
                before[after] = joint
                if goal(after):
                    return path(after, before)
                if len(before) > budget:
                    return None
                stack.append((after, self._next(after, how, order)))
        return Exhausted(before)

    def _next(self, joint: Joint, how: str, order: list[int]) -> Iterator[Joint]:
        poses, fields = joint.poses, self.fields(joint, rest=how is DUTIES)
        if how is ONE:
            first = next((i for i in order if fields[i] is not None), None)
            fields = [field if i == first else None for i, field in enumerate(fields)]
        if how is not STATIC:
            order = sorted(order, key=lambda i: _distance(fields[i], poses[i]), reverse=True)
        forced = (((i, pose),) for i in order for pose in self._forced(joint, i))
        for one in chain(((),), forced):
            self.work -= len(order)
            found = self._propose(joint, fields, order, one)
            if found is not None and (after := self._reached(joint, found)) is not None:
                yield after
        yield from self._singles(joint, self._alive)

    def _new(self, after: Joint, before: dict[Joint, Joint | None]) -> bool:
        """Return whether the search has to examine a state."""
        return after not in before

    def _reached(self, joint: Joint, poses: tuple[int, ...]) -> Joint | None:
        """Return the state after all robots have gone to these poses; None if they cannot, or
        nothing changes."""
        return None if poses == joint.poses else self.floor.moved(joint, poses)

    def _forced(self, joint: Joint, i: int) -> Iterator[int]:
        """Yield the next poses of a robot that the search may force: it can continue there."""
        for pose in self.floor.steps(i, joint.stages)[joint.poses[i]]:
            if self._alive[i] >> pose & 1:
                yield pose

    def _singles(self, joint: Joint, alive: Sequence[Mask] | None = None) -> Iterator[Joint]:
        """Yield the states after one step of one robot to an ``alive`` pose (None: any pose)."""
        for i, pose in self.floor.moves(joint):
            if alive is None or alive[i] >> pose & 1:
                yield self.floor.after(joint, i, pose)

    def fields(self, joint: Joint, *, rest: bool = False) -> list[Field]:
        """Return, for each robot, the distances to its current goal (None: it has no reachable
        goal). ``rest``: while some robots have duties, the robots without a duty have no goal."""
        guided, found = self._duties(joint), list[Field]([None] * len(joint.poses))
        if rest and any(guided):
            guided = [mine or 0 for mine in guided]
        for i in self.floor.robots:
            mine = guided[i]
            own = self.floor.awaited(i, joint.counts[i]) if mine is None else mine
            allowed = self.floor.allowed(i, joint.stages)
            for goals in dict.fromkeys((own & allowed, own)):  # those behind obstacles last
                if goal := self._aim(joint, i, goals, own=mine is None):
                    field = self.floor.graphs[i].distances(goal, allowed)
                    found[i] = field if field[joint.poses[i]] < FAR else None
                if found[i] is not None:
                    break
        return found

    def _duties(self, joint: Joint) -> Sequence[Mask | None]:
        if joint.stages not in self._guided:
            self._guided[joint.stages] = self.guide(joint.stages, joint.poses)
        return self._guided[joint.stages]

    def _aim(self, joint: Joint, i: int, goal: Mask, *, own: bool) -> Mask:
        """Return the poses to reach first for a goal. ``own``: whether it is its own target."""
        del joint, i, own
        return goal

    def _legs(self, most: int) -> list[Joint] | None:
        """Return the states of a chain of legs; None if it is not found soon. In a leg, all other
        robots let one robot pass. A failed leg also removes a random number of the last legs."""
        legs: list[list[Joint]] = [[self.start]]
        vain = made = longest = failed = 0
        while not self.goal(legs[-1][-1]):
            leg, spent = self._leg(legs[-1][-1])
            vain, made = vain + spent, made + 1
            if (
                vain > most
                or made > LEGS * len(self.floor.robots)
                or self.work <= 0
                or (leg is None and len(legs) == 1)
            ):
                return None
            if leg is None:
                failed = failed + 1 if len(legs) <= longest else 1
                longest = max(longest, len(legs))
                back = 1 + self.random.randrange(failed)
                del legs[max(1, len(legs) - back) :]
            else:
                legs.append(leg)
        return [legs[0][0], *(joint for leg in legs[1:] for joint in leg[1:])]

    def _leg(self, start: Joint) -> tuple[list[Joint] | None, int]:
        fields = self.fields(start)
        wanting = [i for i in self.floor.robots if _misses(fields[i], start.poses[i])]
        self.random.shuffle(wanting)
        members = self.floor.team.members  # robots that stay at their targets go last
        wanting.sort(key=lambda i: members[i].pursuit.settles)
        vain = 0
        for i in wanting:
            others = [j for j in self.floor.robots if j != i]
            self.random.shuffle(others)
            field = fields[i]
            assert field is not None
            budget = LEG + field[start.poses[i]]
            found = self.deep(start, self._reaches(start, i, field), budget, ONE, [i, *others])
            if found is not None and not isinstance(found, Exhausted):
                return found, vain
            vain += budget
        return None, vain

    def _reaches(self, start: Joint, i: int, field: Sequence[int]) -> Goal:
        def reached(joint: Joint) -> bool:
            changed = joint.stages != start.stages or joint.counts[i] != start.counts[i]
            return changed or field[joint.poses[i]] == 0 or self.goal(joint)

        return reached


def completes(floor: Floor, joint: Joint, served: frozenset[int]) -> bool:
    """Return whether a plan may end in this joint state."""
    return floor.completed(joint, served) and not (floor.ready and jammed(floor, joint))


def jammed(floor: Floor, joint: Joint) -> bool:
    """Return whether a robot that has not completed its mission is immobile: all its steps, and
    those of robots in its way, lead into regions of such robots. If the floor must stay ``ready``,
    this includes robots that have completed their rounds and do not settle, since a resolution
    would restart their rounds."""
    poses, size, members = joint.poses, floor.team.size, floor.team.members
    taken = {poses[i] % size for i in floor.robots}
    stuck = {i for i in floor.robots if taken.issuperset(floor.ahead(i, poses[i]))}
    before = None
    while stuck != before:
        before, now = stuck, stuck
        shut = {i: {poses[j] % size for j in members[i].rivals & now} for i in now}
        stuck = {i for i in now if shut[i].issuperset(floor.ahead(i, poses[i]))}
    left = ((i, floor.awaited(i, joint.counts[i])) for i in stuck)
    return any(
        not floor.is_done(i, joint.counts[i])
        or (goal and not goal >> poses[i] & 1)
        or (floor.ready and not members[i].pursuit.settles)
        for i, goal in left
    )


def _distance(field: Field, pose: int) -> int:
    """Return the number of steps from a robot's pose to its goal; -1 if it has no goal."""
    return -1 if field is None else field[pose]


def _misses(field: Field, pose: int) -> bool:
    """Return whether a robot has a goal that it has not reached."""
    return field is not None and field[pose] > 0


def path(end: Joint, before: dict[Joint, Joint | None]) -> list[Joint]:
    found = [end]
    while (former := before[found[-1]]) is not None:
        found.append(former)
    return found[::-1]


Field = Sequence[int] | None
"""The steps from each pose to a robot's goal poses; None: it has no goal and may be pushed."""


class Proposals:
    """PIBT (Okumura et al., 2022): next joint poses in which robots approach their goals and push
    each other. Robots never swap regions and never rotate in a circle."""

    def __init__(self, floor: Floor, random: Random, alive: Sequence[int] | None = None) -> None:
        self._alive = alive
        self._floor, self._random, self._size = floor, random, floor.team.size
        self._members = floor.team.members
        self._rivals = [member.rivals for member in self._members]
        self._zoned = [bool(member.zones) for member in self._members]

    def propose(
        self,
        joint: Joint,
        fields: Sequence[Field],
        order: Sequence[int],
        forced: Sequence[tuple[int, int]] = (),
    ) -> tuple[int, ...] | None:
        """Return the next poses; None if a robot can neither move nor stay. ``order``: the robots
        in the order in which they choose; ``forced``: the poses that some robots must take."""
        self._stages, self._poses, self._fields = joint.stages, joint.poses, fields
        self._now: dict[int, list[int]] = {}
        for i in order:
            self._now.setdefault(joint.poses[i] % self._size, []).append(i)
        self._next: dict[int, int] = {}
        self._entered: dict[int, list[int]] = {}
        for i, only in (*forced, *((i, None) for i in order)):
            if i not in self._next and not self._place(i, frozenset(), only):
                return None
        found = [*joint.poses]
        for i, pose in self._next.items():
            found[i] = pose
        return tuple(found)

    def _place(self, i: int, pushing: frozenset[int], only: int | None = None) -> bool:
        """Assign a pose to a robot and to the robots that it pushes away. ``pushing``: the robots
        that have pushed this robot."""
        mark = len(self._next)
        for pose in self._ranked(i) if only is None else (only,):
            if self._take(i, pose, pushing):
                return True
            while len(self._next) > mark:
                j, undone = self._next.popitem()
                self._entered[undone % self._size].remove(j)
        return False

    def _take(self, i: int, pose: int, pushing: frozenset[int]) -> bool:
        region, rivals, after = pose % self._size, self._rivals[i], self._next
        if (entered := self._entered.get(region)) and not rivals.isdisjoint(entered):
            return False
        if self._zoned[i] and self._members[i].shut(self._occupied()) >> region & 1:
            return False
        pushed = []
        if region != self._poses[i] % self._size:
            for j in self._now.get(region, ()):
                if j in rivals:
                    if j in pushing or (j in after and after[j] % self._size == region):
                        return False
                    if j not in after:
                        pushed.append(j)
        self._entered.setdefault(region, []).append(i)
        after[i] = pose
        return not pushed or all(j in after or self._place(j, pushing | {i}) for j in pushed)

    def _occupied(self) -> list[Mask]:
        """Return the regions that each robot occupies before and after its step."""
        size, after, poses = self._size, self._next, enumerate(self._poses)
        return [1 << pose % size | 1 << after.get(j, pose) % size for j, pose in poses]

    def _ranked(self, i: int) -> list[int]:
        """Return the possible next poses of a robot: by distance to its goal, then free before
        occupied poses."""
        here, field, rivals = self._poses[i], self._fields[i], self._rivals[i]
        now, size, draw = self._now, self._size, self._random.random
        ranks = [((0 if field is None else field[here]) + draw() / 2, here)]
        for pose in self._floor.steps(i, self._stages)[here]:
            if self._alive is not None and not self._alive[i] >> pose & 1:
                continue
            there = now.get(pose % size)
            taken = 0.5 if there is not None and not rivals.isdisjoint(there) else 0
            ranks.append(((1 if field is None else field[pose]) + taken + draw() / 2, pose))
        ranks.sort()
        return [pose for _, pose in ranks]
