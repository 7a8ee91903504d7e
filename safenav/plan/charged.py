"""Joint plans for which the charges suffice: a search in which each transition takes its ticks.

A robot on a charger charges while it stays, other robots use charge while they wait. A transition
lasts as long as its slowest step. A robot enters a region in the transition in which another one
leaves it only if a run would let it: in lockstep, if the other one's turn is earlier, and its step
takes one tick. So a run is never later than these transitions, and no robot has less charge. Most
robots need not wait for the slowest: the execution of a plan (``course``) says how long it takes.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import cycle, islice

from safenav.data import cached_method
from safenav.plan.course import AMPLE, Course, course_of, needed
from safenav.plan.search import (
    FIRST_BUDGET,
    ORDERS,
    ROUNDS,
    Answer,
    Exhausted,
    Goal,
    Guide,
    Search,
    path,
)
from safenav.scenario.model import DECIMALS
from safenav.team.battery import NEVER, dominated
from safenav.team.floor import Floor, Joint, Stages
from safenav.world.poses import Mask

Charges = tuple[float, ...]
Effect = tuple[
    tuple[tuple[int, ...], tuple[tuple[int, int], ...], Stages],
    tuple[tuple[int, float, float, float], ...],
]
"""The state after a transition, without charges; and for each robot with a battery: its number, its
maximum charge, its gain, and the least charge that it then needs."""

TRIES, BETTER, LEGS = 12, 20_000, 3
"""Maximum number of searches for a better plan; the minimum work of each; the number of plans
for a part of the mission that are tried."""


class ChargedSearch(Search):
    """A search with charges. ``start``: a state with the charges of all robots. ``how``: whether
    charges must suffice forever, not only for the plan, and whether robots leave chargers only with
    a full battery. ``brisk``: whether each step counts as one tick; its plans are to be
    examined."""

    def __init__(
        self,
        floor: Floor,
        served: frozenset[int],
        guide: Guide,
        start: Joint,
        seed: int,
        work: int,
        how: tuple[bool, bool],
        check: Callable[[], None] = lambda: None,
        *,
        brisk: bool = False,
    ) -> None:
        super().__init__(floor, served, guide, start, seed, work, check)
        self.how, self.team, self.brisk = how, floor.team, brisk
        self.step_ticks = (1,) * len(start.poses) if brisk else self.team.step_ticks
        self.live = self.team.live
        self.energies = {
            i: energy for i in floor.robots if (energy := self.team.members[i].energy) is not None
        }
        self.furthest = [start]
        self._best: dict[object, list[Charges]] = {}
        self._effects: dict[object, dict[tuple[int, ...], Effect]] = {}
        self._settled: Joint | None = None
        self._home: dict[int, Mask] = {}
        self._joint: Joint | None = None
        self._ways: dict[tuple[int, ...], Effect] = {}
        # A robot without further goals waits off the chargers only with ample charge.
        self._spare: dict[int, float] = {}
        for i, energy in self.energies.items() if super().goal(start) else ():
            if energy.battery.stay and not energy.charging(start.poses[i]):
                self._spare[i] = AMPLE * energy.battery.capacity

    def goal(self, joint: Joint) -> bool:
        return super().goal(joint) and all(self._lasts(joint))

    def _lasts(self, joint: Joint) -> Iterator[bool]:
        for i in self.energies if self.how[0] else self._spare:
            energy = self.energies[i]
            spare = 0 if energy.charging(joint.poses[i]) else self._spare.get(i, 0)
            need = needed(self.floor, joint, i) if self.how[0] or spare else 0
            yield joint.charges[i] >= need + spare

    def courses(self, states: list[Joint], spent: int) -> Iterator[Course]:
        """Yield the executions of these states and of the states of further searches; ``spent``:
        the work for the first."""
        enough = self.work - max(BETTER, spent)
        known = [states]
        yield from self.course(states)
        for how in islice(cycle(ORDERS), TRIES):
            if len(states) == 1 or self.work < enough:
                break
            most = min(FIRST_BUDGET, *map(len, known))
            found = self.deep(self.start, self.goal, most, how, self._order(how))
            if found is not None and found not in known:
                known.append(found)
                yield from self.course(found)
        for each in self.alternatives(len(states)) if self.brisk else ():
            yield from self.course(each)

    def course(self, states: Sequence[Joint]) -> Iterator[Course]:
        """Yield the execution of these states, if the charges suffice for it."""
        course = course_of(self.floor, states, exact=not self.brisk)
        yield from () if course is None else (course,)

    def deep(
        self, start: Joint, goal: Goal, budget: int, how: str, order: list[int], far: int = 0
    ) -> Answer:
        self._best = {}
        found = super().deep(start, goal, budget, how, order, far)
        if found is not None and not isinstance(found, Exhausted):
            return found
        if start is self.start and self.how[0]:
            end = max(self.seen, key=self.progress)
            if self.progress(end) > self.progress(self.furthest[-1]):
                self.furthest = path(end, self.seen)
        return None

    def progress(self, joint: Joint) -> tuple[int, int]:
        """Return the numbers of needs fulfilled, and of targets met by robots that have rounds to
        complete here."""
        each = zip(self.team.members, joint.counts, self.floor.wanted, strict=True)
        met = sum(member.pursuit.reached(*count) for member, count, rounds in each if rounds)
        return sum(stage.need for stage in joint.stages), met

    def legs(self) -> Iterator[list[Joint]]:
        """Yield plans for a part of the mission, preferred ones first: at least half of the path to
        the greatest progress found; more of it if all robots keep ample charge."""
        begun, way = self.progress(self.start), self.furthest
        half = range(len(way) // 2, len(way))
        left = {
            k: min(self._left(way[k]), default=1) for k in half if self.progress(way[k]) > begun
        }
        ranks = {k: (AMPLE, k) if least >= AMPLE else (least, 0) for k, least in left.items()}
        for k in sorted(ranks, key=ranks.__getitem__, reverse=True):
            yield way[: k + 1]

    def _left(self, joint: Joint) -> Iterator[float]:
        """Yield the part of each battery that its robot does not need to continue."""
        for i, energy in self.energies.items():
            spare = joint.charges[i] - needed(self.floor, joint, i)
            yield spare / energy.battery.capacity

    def singles(self, budget: int) -> Answer:
        """Return None: a complete search would have to examine each possible charge of a state."""
        del budget
        return None

    def _singles(self, joint: Joint, alive: Sequence[Mask] | None = None) -> Iterator[Joint]:
        del alive
        poses = joint.poses
        if (stay := self._reached(joint, poses)) is not None:
            yield stay
        for i, pose in self.floor.moves(joint):
            if (after := self._reached(joint, (*poses[:i], pose, *poses[i + 1 :]))) is not None:
                yield after

    def _new(self, after: Joint, before: dict[Joint, Joint | None]) -> bool:
        """Return whether a state is worth examining: no known state with the same poses and
        progress has at least the same charges."""
        best = self._best.setdefault(after[:3], [])
        return after not in before and not dominated(after.charges, best)

    def _forced(self, joint: Joint, i: int) -> Iterator[int]:
        """Yield the poses that the search may force on a robot; on a charger also its own."""
        if i in self.energies and self.energies[i].charging(joint.poses[i]):
            yield joint.poses[i]
        yield from super()._forced(joint, i)

    def _reached(self, joint: Joint, poses: tuple[int, ...]) -> Joint | None:
        if joint is not self._joint:
            self._joint, self._ways = joint, self._effects.setdefault(joint[:3], {})
        if (effect := self._ways.get(poses)) is None:
            effect = self._ways[poses] = self._effect(joint, poses)
        after, gains = effect
        charges = [*joint.charges]
        for i, most, gain, least in gains:
            charges[i] = min(most, round(charges[i] + gain, DECIMALS))
            if charges[i] < least:
                return None
        found = Joint(*after, tuple(charges))
        return None if found == joint else found

    def _effect(self, joint: Joint, poses: tuple[int, ...]) -> Effect:
        poses = self._held(joint, poses)
        after, ticks = self.floor.moved(joint, poses), 1
        for i, pose in enumerate(poses):
            ticks = max(ticks, self.step_ticks[i] if pose != joint.poses[i] else 1)
        acts = self.live and after.stages != joint.stages
        acting = self.floor.acting(joint.stages) if acts else 0
        gains = []
        for i, energy in self.energies.items():
            on, moves = energy.chargers >> poses[i] & 1, poses[i] != joint.poses[i]
            waits: float = ticks - self.step_ticks[i] if moves else ticks
            waits += self.team.act_times[i] if acting >> poses[i] % self.team.size & 1 else 0
            gain: float = -energy.battery.move if moves else on * energy.battery.charge * ticks
            gain -= 0 if on else energy.battery.stay * waits
            least = self._least(i, after.poses[i], after.counts[i])
            gains.append((i, energy.battery.capacity, gain, least))
        return after[:3], tuple(gains)

    def _held(self, joint: Joint, poses: tuple[int, ...]) -> tuple[int, ...]:
        """Return the poses, with each robot that would wait for another one kept in its present
        pose."""
        size, found = self.team.size, [*poses]
        there: dict[int, list[int]] = {}
        for j in self.floor.robots:
            there.setdefault(joint.poses[j] % size, []).append(j)
        again = True
        while again:
            again = False
            for i in self.floor.robots:
                region = found[i] % size
                if found[i] == joint.poses[i] or region == joint.poses[i] % size:
                    continue
                for j in there.get(region, ()):
                    if j not in self.team.members[i].rivals:
                        continue
                    left = found[j] % size != region and not self.live
                    if not (left and j < i and self.step_ticks[j] == 1):
                        found[i], again = joint.poses[i], True
                        break
        return tuple(found)

    def fits(self, joint: Joint) -> bool:
        """Return whether each charge is at least what its robot alone needs."""
        return all(
            joint.charges[i] >= self._least(i, joint.poses[i], joint.counts[i])
            for i in self.energies
        )

    @cached_method
    def _least(self, i: int, pose: int, count: tuple[int, int]) -> float:
        """Return the charge that a robot alone needs: other robots and open obstacles only restrict
        it."""
        if self.how[0]:
            energy = self.energies[i]
            return energy.need(self.floor.floors[i], pose, energy.turn(count[0]))
        return least_of(self.floor, i, pose, count)

    def _homes(self, joint: Joint) -> dict[int, Mask]:
        """Return where robots without a goal and without ample charge wait: those with the least
        charge choose their chargers first."""
        if joint is self._settled:
            return self._home
        self._settled, self._home, taken = joint, {}, 0
        for i in sorted(self.energies, key=joint.charges.__getitem__):
            energy, graph, pose = self.energies[i], self.floor.graphs[i], joint.poses[i]
            own = self._duties(joint)[i]
            if self.floor.awaited(i, joint.counts[i]) if own is None else own:
                continue
            ample = needed(self.floor, joint, i) + AMPLE * energy.battery.capacity
            if not energy.charging(pose) and joint.charges[i] >= ample:
                continue
            allowed = self.floor.allowed(i, joint.stages)
            free = energy.home(allowed) & ~graph.poses_on(taken)
            near = graph.nearest(pose, free, allowed) if free else 0
            self._home[i], taken = near, taken | graph.regions_of(near)
        return self._home

    def _aim(self, joint: Joint, i: int, goal: Mask, *, own: bool) -> Mask:
        if (energy := self.energies.get(i)) is None:
            return goal
        allowed = self.floor.allowed(i, joint.stages)
        if not goal:
            return self._homes(joint).get(i, 0)
        turn = energy.turn(joint.counts[i][0] + own)
        charge = joint.charges[i] - self._spare.get(i, 0)
        return energy.aim(allowed, goal, turn, (joint.poses[i], charge), self.how)


def least_of(floor: Floor, i: int, pose: int, count: tuple[int, int]) -> float:
    """Return the charge with which a robot with a battery alone completes its rounds."""
    member = floor.team.members[i]
    energy, pursuit = member.energy, member.pursuit
    assert energy is not None
    if floor.is_done(i, count):
        return 0
    left = floor.wanted[i] * pursuit.targets - count[1]
    if pursuit.settles:
        left = pursuit.targets - min(count[0], pursuit.targets - 1)
    return energy.suffices(floor.floors[i], energy.turn(count[0]), left).get(pose, NEVER)


def raced(
    searches: Sequence[ChargedSearch], work: int, goes_on: Callable[[Joint], bool]
) -> Course | None:
    """Return the plan that ends first, of searches with this much work each, after which the team
    ``goes_on``; None if there is none. They take turns until one turn after the first plan, so that
    a search without a plan costs at most as much as the others."""
    left, found, turn, until = [*searches], list[Course](), 0, ROUNDS
    while turn < until:
        turn += 1
        for search in [*left]:
            if (answer := search.run(turn)) is not None:
                left.remove(search)
                found += search.courses(answer, work - search.work)
                until = min(until, turn + 1) if found else until
    ends = sorted(found, key=lambda course: course.cost)
    return next((course for course in ends[:LEGS] if goes_on(course.states[-1])), None)


def furthest(searches: Sequence[ChargedSearch], goes_on: Callable[[Joint], bool]) -> Course | None:
    """Return the partial plan with the greatest progress after which the team ``goes_on``; None if
    there is none."""
    every = sorted(searches, key=lambda each: each.progress(each.furthest[-1]), reverse=True)
    for search, leg in islice(((one, leg) for one in every for leg in one.legs()), LEGS):
        course = next(search.course(leg), None) if goes_on(leg[-1]) else None
        if course is not None:
            return course
    return None


def sustained(floor: Floor) -> bool:
    """Return whether the chargers can give at least what all robots use by standing."""
    members = (floor.team.members[i] for i in floor.robots)
    batteries = [member.energy.battery for member in members if member.energy is not None]
    most = max((battery.charge for battery in batteries), default=0)
    return len(floor.team.scenario.chargers) * most >= sum(each.stay for each in batteries)
