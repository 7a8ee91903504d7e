"""Joint plans with sufficient charges: a search in which each transition takes its ticks.

A robot on a charger charges while it stays; other robots use charge while they wait. A transition
lasts as long as its slowest step. A robot enters a region that another robot leaves only if a run
allows this: in lockstep, if the other robot's turn is earlier and its step takes one tick. So a run
is never later than these transitions, and its robots have at least these charges. Most robots need
not wait for the slowest: ``course`` computes the duration of a plan.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from itertools import cycle, islice

from safenav.data import cached_method
from safenav.plan.course import Course, course_of, needed
from safenav.plan.search import FIRST_BUDGET, ORDERS, ROUNDS, Answer, Exhausted, Goal, Guide, Search
from safenav.scenario.model import DECIMALS
from safenav.team.battery import AMPLE, NEVER, dominated
from safenav.team.floor import Floor, Joint, Stages
from safenav.world.poses import Mask

Charges = tuple[float, ...]
Effect = tuple[
    tuple[tuple[int, ...], tuple[tuple[int, int], ...], Stages],
    tuple[tuple[int, float, float, float], ...],
]
"""The state after a transition, without charges; and for each robot with a battery: its number, its
maximum charge, its gain, and the least charge that it then needs."""

TURN = 8
"""Ticks that a robot's turn at a shared charger takes, besides those in which it charges."""
TRIES, BETTER, ENDS = 12, 20_000, 3
"""Maximum number of searches for a better plan; minimum work for them; number of plans whose ends
are examined."""


class ChargedSearch(Search):
    """A search with charges. ``start``: a state with the charges of all robots. ``how``: whether
    charges must suffice forever, not only for the plan; whether robots leave chargers only with a
    full battery. ``further``: whether robots have more work after the plan; those that share
    chargers must then be able to charge in turn."""

    def __init__(
        self,
        floor: Floor,
        served: frozenset[int],
        guide: Guide,
        start: Joint,
        seed: int,
        work: int,
        how: tuple[bool, bool],
        further: bool,
        check: Callable[[], None] = lambda: None,
    ) -> None:
        super().__init__(floor, served, guide, start, seed, work, check)
        self.turns = further and len(floor.team.charged) > len(floor.team.scenario.chargers)
        self.how, self.team, self.live = how, floor.team, floor.team.live
        self.energies = {
            i: energy for i in floor.robots if (energy := self.team.members[i].energy) is not None
        }
        self._best: dict[object, list[Charges]] = {}
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
        if self.how[0] and self.turns:
            chargers = len(self.team.scenario.chargers)
            margins = enumerate(sorted(self._margins(joint)))
            yield all(margin >= k // chargers for k, margin in margins)

    def _margins(self, joint: Joint) -> Iterator[float]:
        """Yield, for each robot whose stay uses charge, the number of turns of other robots at a
        charger for which its charge suffices."""
        for i, energy in self.energies.items():
            battery = energy.battery
            if battery.stay and not energy.charging(joint.poses[i]):
                turn = battery.stay * (AMPLE * battery.capacity / battery.charge + TURN)
                yield (joint.charges[i] - needed(self.floor, joint, i)) / turn

    def courses(self, states: list[Joint], spent: int) -> Iterator[Course]:
        """Yield the executions of a plan with these states, and of plans that further searches
        find. ``spent``: the work for the first plan."""
        enough = self.work - max(BETTER, spent)
        known = [states]
        yield course_of(self.floor, states)
        for how in islice(cycle(ORDERS), TRIES):
            if len(states) == 1 or self.work < enough:
                break
            most = min(FIRST_BUDGET, *map(len, known))
            found = self.deep(self.start, self.goal, most, how, self._order(how))
            if found is not None and found not in known:
                known.append(found)
                yield course_of(self.floor, found)

    def deep(self, start: Joint, goal: Goal, budget: int, how: str, order: list[int]) -> Answer:
        self._best = {}
        found = super().deep(start, goal, budget, how, order)
        return None if isinstance(found, Exhausted) else found

    def singles(self, budget: int) -> Answer:
        """Return None, since a complete search would need each possible charge of a state."""
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
        """Yield poses that the search may force on a robot; on a charger also its own."""
        if i in self.energies and self.energies[i].charging(joint.poses[i]):
            yield joint.poses[i]
        yield from super()._forced(joint, i)

    def _reached(self, joint: Joint, poses: tuple[int, ...]) -> Joint | None:
        after, gains = self._effect(Joint(*joint[:3]), poses)
        charges = [*joint.charges]
        for i, most, gain, least in gains:
            charges[i] = min(most, round(charges[i] + gain, DECIMALS))
            if charges[i] < least:
                return None
        found = Joint(*after, tuple(charges))
        return None if found == joint else found

    @cached_method
    def _effect(self, joint: Joint, poses: tuple[int, ...]) -> Effect:
        """Return the next state and, for each robot with a battery, its capacity, gain and need."""
        poses = self._held(joint, poses)
        after, ticks = self.floor.moved(joint, poses), 1
        for i, pose in enumerate(poses):
            ticks = max(ticks, self.team.step_ticks[i] if pose != joint.poses[i] else 1)
        acts = self.live and after.stages != joint.stages
        acting = self.floor.acting(joint.stages) if acts else 0
        gains = []
        for i, energy in self.energies.items():
            on, moves = energy.chargers >> poses[i] & 1, poses[i] != joint.poses[i]
            waits: float = ticks - self.team.step_ticks[i] if moves else ticks
            waits += self.team.act_times[i] if acting >> poses[i] % self.team.size & 1 else 0
            gain: float = -energy.battery.move if moves else on * energy.battery.charge * ticks
            gain -= 0 if on else energy.battery.stay * waits
            least = self._least(i, after.poses[i], after.counts[i])
            gains.append((i, energy.battery.capacity, gain, least))
        return after[:3], tuple(gains)

    def _held(self, joint: Joint, poses: tuple[int, ...]) -> tuple[int, ...]:
        """Return ``poses``, with the present pose of each robot that would have to wait for another
        robot."""
        size, found, there = self.team.size, [*poses], defaultdict[int, list[int]](list)
        for j in self.floor.robots:
            there[joint.poses[j] % size].append(j)

        def waits(i: int) -> bool:
            region, rivals = found[i] % size, self.team.members[i].rivals
            if region == joint.poses[i] % size:
                return False
            for j in rivals.intersection(there.get(region, ())):
                first = j < i and self.team.step_ticks[j] == 1 and not self.live
                if not first or found[j] % size == region:
                    return True
            return False

        while late := [i for i in self.floor.robots if waits(i)]:
            for i in late:
                found[i] = joint.poses[i]
        return tuple(found)

    @cached_method
    def _least(self, i: int, pose: int, count: tuple[int, int]) -> float:
        """Return the charge that a robot needs if it is alone, a lower bound for the team."""
        if self.how[0]:
            energy = self.energies[i]
            return energy.need(self.floor.floors[i], pose, energy.turn(count[0]))
        return least_of(self.floor, i, pose, count)

    def _aim(self, joint: Joint, i: int, goal: Mask, *, own: bool) -> Mask:
        if (energy := self.energies.get(i)) is None:
            return goal
        allowed = self.floor.allowed(i, joint.stages)
        if not goal:  # it waits on a charger unless its charge is ample
            ample = needed(self.floor, joint, i) + AMPLE * energy.battery.capacity
            return 0 if joint.charges[i] >= ample else energy.home(allowed)
        turn = energy.turn(joint.counts[i][0] + own)
        charge = joint.charges[i] - self._spare.get(i, 0)
        return energy.aim(allowed, goal, turn, (joint.poses[i], charge), self.how)


def least_of(floor: Floor, i: int, pose: int, count: tuple[int, int]) -> float:
    """Return the least charge with which a robot that has a battery completes its rounds alone."""
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
    """Return the plan that ends first among the plans of several searches after which the team
    ``goes_on``; None if there is none. The searches take turns until one turn after the first plan,
    so a search without a plan costs at most as much as the others."""
    left, found, turn, until = [*searches], list[Course](), 0, ROUNDS
    while turn < until:
        turn += 1
        for search in [*left]:
            if (answer := search.run(turn)) is not None:
                left.remove(search)
                every = search.courses(answer, work - search.work)
                found += (course for course in every if not course.strands)
                until = min(until, turn + 1) if found else until
    ends = sorted(found, key=lambda course: course.cost)
    return next((course for course in ends[:ENDS] if goes_on(course.states[-1])), None)
