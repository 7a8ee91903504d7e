"""Joint plans for which the charges suffice: a search in which each transition takes its ticks.

A robot on a charger charges while it stays, the others use charge while they wait. A transition
lasts as long as its slowest step. A robot enters a region in the transition in which another one
leaves it only if a run would let it: in lockstep, if the other one's turn is earlier, and its step
takes one tick. So a run is never later than the plan, and no robot has less charge than planned.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import cycle, islice, pairwise

from safenav.data import cached_method
from safenav.plan.order import plan_of
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
from safenav.team.state import Plan, Waypoint
from safenav.world.poses import Mask

Charges = tuple[float, ...]
Effect = tuple[
    tuple[tuple[int, ...], tuple[tuple[int, int], ...], Stages],
    tuple[tuple[int, float, float, float], ...],
]
"""The state after a transition, without charges; and for each robot with a battery: its number, its
maximum charge, its gain, and the least charge that it then needs."""

TRIES, BETTER = 12, 20_000
"""Maximum number of searches for a better plan; the minimum work of each."""
AMPLE = 0.25
"""Part of the capacity that each robot has left at the end of a plan for a part of the mission, if
possible: others may use the chargers first."""


class ChargedSearch(Search):
    """``start``: with the charges of all robots. ``how``: whether they must suffice forever, not
    only for the plan; robots leave chargers with a full battery."""

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
    ) -> None:
        super().__init__(floor, served, guide, start, seed, work, check)
        self.how, self.team = how, floor.team
        self.live = self.team.live
        self.energies = {
            i: energy for i in floor.robots if (energy := self.team.members[i].energy) is not None
        }
        self.furthest = [start]
        self._best: dict[object, list[Charges]] = {}
        self._effects: dict[object, dict[tuple[int, ...], Effect]] = {}
        self._joint: Joint | None = None
        self._ways: dict[tuple[int, ...], Effect] = {}
        # Without further goals, a robot charges to half of what it could have on its return.
        self._spare: dict[int, float] = {}
        for i, energy in self.energies.items() if super().goal(start) else ():
            if energy.battery.stay and not energy.charging(start.poses[i]):
                need = needed(floor, start, i)
                self._spare[i] = max(0.0, (energy.battery.capacity - 2 * need) / 2)

    def goal(self, joint: Joint) -> bool:
        return super().goal(joint) and all(self._lasts(joint))

    def _lasts(self, joint: Joint) -> Iterator[bool]:
        for i, energy in self.energies.items() if self.how[0] else ():
            spare = 0 if energy.charging(joint.poses[i]) else self._spare.get(i, 0)
            yield joint.charges[i] >= needed(self.floor, joint, i) + spare

    def bettered(self, best: list[Joint], spent: int) -> list[Joint]:
        """Return the plan with the least time of several; ``spent``: the work for the first."""
        enough = self.work - max(BETTER, spent)
        for how in islice(cycle(ORDERS), TRIES):
            if len(best) == 1 or self.work < enough:
                break
            most = min(FIRST_BUDGET, len(best))
            found = self.deep(self.start, self.goal, most, how, self._order(how))
            if found is not None and self.ticks(found) < self.ticks(best):
                best = found
        return best

    def ticks(self, states: Sequence[Joint]) -> float:
        """Return the time of a plan."""
        return sum(_duration(self.team.step_ticks, *each) for each in pairwise(states))

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
        """Return the numbers of needs fulfilled and of targets met."""
        pairs = zip(self.team.members, joint.counts, strict=True)
        met = sum(member.pursuit.reached(*count) for member, count in pairs)
        return sum(stage.need for stage in joint.stages), met

    def leg(self) -> list[Joint] | None:
        """Return a plan for a part of the mission: the way to the greatest progress that has been
        found, or half of it and as much more as all robots have ample charge."""
        begun, way, ends = self.progress(self.start), self.furthest, dict[int, float]()
        for place in range(len(way) // 2, len(way)):
            if self.progress(way[place]) > begun:
                ends[place] = min(self._left(way[place]), default=1)
        ample = [place for place, left in ends.items() if left >= AMPLE]
        last = ample[-1] if ample else max(ends, key=ends.__getitem__, default=0)
        return way[: last + 1] if ends else None

    def _left(self, joint: Joint) -> Iterator[float]:
        """Yield the part of each battery that its robot does not need to continue."""
        for i, energy in self.energies.items():
            spare = joint.charges[i] - needed(self.floor, joint, i)
            yield spare / energy.battery.capacity

    def singles(self, budget: int) -> Answer:
        """Return None: a complete search would examine each charge of a state."""
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
        """Return whether a state is worth examining: no known one has at least the same charges in
        the same place."""
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
        """Return the poses, in which robots that would have to wait for another one to leave stay
        where they are."""
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
                    if not (left and j < i and self.team.members[j].ticks == 1):
                        found[i], again = joint.poses[i], True
                        break
        return tuple(found)

    def fits(self, joint: Joint) -> bool:
        """Return whether the charges may still suffice."""
        return all(
            joint.charges[i] >= self._least(i, joint.poses[i], joint.counts[i])
            for i in self.energies
        )

    @cached_method
    def _least(self, i: int, pose: int, count: tuple[int, int]) -> float:
        """Return the charge that a robot alone needs: others and open obstacles only restrict
        it."""
        energy, allowed = self.energies[i], self.floor.floors[i]
        turn = energy.turn(count[0])
        if self.how[0]:
            return energy.need(allowed, pose, turn)
        if self.floor.is_done(i, count):
            return 0
        return energy.suffices(allowed, turn, self._goals(i, count)).get(pose, NEVER)

    def _goals(self, i: int, count: tuple[int, int]) -> int:
        """Return the targets that a robot has still to meet in turn."""
        pursuit = self.team.members[i].pursuit
        if pursuit.settles:
            return pursuit.targets - min(count[0], pursuit.targets - 1)
        return self.team.rounds * pursuit.targets - count[1]

    def _aim(self, joint: Joint, i: int, goal: Mask, *, own: bool) -> Mask:
        if (energy := self.energies.get(i)) is None:
            return goal
        allowed = self.floor.allowed(i, joint.stages)
        if not goal:
            return energy.home(allowed)
        turn = energy.turn(joint.counts[i][0] + own)
        charge = joint.charges[i] - self._spare.get(i, 0)
        return energy.aim(allowed, goal, turn, (joint.poses[i], charge), self.how)


def raced(searches: Sequence[ChargedSearch], work: int) -> list[Joint] | None:
    """Return the best plan of searches with so much work each. They take turns until one turn after
    the first plan: where one of them finds nothing, it costs as much as the others at most."""
    left, found, turn, until = [*searches], list[list[Joint]](), 0, ROUNDS
    while turn < until:
        turn += 1
        for search in [*left]:
            if (answer := search.run(turn)) is not None:
                left.remove(search)
                found.append(search.bettered(answer, work - search.work))
                until = min(until, turn + 1)
    return min(found, key=searches[0].ticks, default=None)


def furthest(searches: Sequence[ChargedSearch]) -> list[Joint] | None:
    """Return the plan for a part of the mission of the search with the greatest progress."""
    most = max(searches, key=lambda each: each.progress(each.furthest[-1]), default=None)
    return None if most is None else most.leg()


def sustained(floor: Floor) -> bool:
    """Return whether the chargers can give at least what all robots use by standing."""
    members = (floor.team.members[i] for i in floor.robots)
    batteries = [member.energy.battery for member in members if member.energy is not None]
    most = max((battery.charge for battery in batteries), default=0)
    return len(floor.team.scenario.chargers) * most >= sum(each.stay for each in batteries)


def _duration(times: Sequence[float], before: Joint, joint: Joint) -> float:
    """Return the time of a transition, that of its slowest step, by the times of each robot."""
    steps = zip(times, before.poses, joint.poses, strict=True)
    return max((time for time, a, b in steps if a != b), default=1)


Part = tuple[Floor, Sequence[Joint]]
"""The floor of some robots that need not wait for others, and the states of their plan."""


def charged_plan(parts: Sequence[Part], begun: float) -> Plan | None:
    """Return the plan of all parts; None if some robot cannot wait for the end of the others.
    ``begun``: the tick before its first one; in a live run its start."""
    team = parts[0][0].team
    ticks = [sum(_duration(team.step_ticks, *e) for e in pairwise(states)) for _, states in parts]
    charges = [0.0] * len(team.members)
    for (floor, states), own in zip(parts, ticks, strict=True):
        last, waits = states[-1], max(ticks) - own
        for i in floor.robots:
            energy, charges[i] = team.members[i].energy, last.charges[i]
            if waits and energy is not None and not energy.charging(last.poses[i]):
                charges[i] -= waits * energy.battery.stay
                if charges[i] < _needed_at_end(floor, last, i):
                    return None
    plans = [_plan(*part, begun) for part in parts]
    ways = zip(*(plan.ways for plan in plans), strict=True)
    joined = tuple(next(filter(None, each), ()) for each in ways)
    return Plan(joined, plans[0].foreseen, tuple(charges))


def needed(floor: Floor, joint: Joint, i: int) -> float:
    """Return the charge with which a robot with a battery continues forever from where it is."""
    energy = floor.team.members[i].energy
    assert energy is not None
    allowed, turn = floor.allowed(i, joint.stages), energy.turn(joint.counts[i][0])
    return energy.need(allowed, joint.poses[i], turn)


def _needed_at_end(floor: Floor, last: Joint, i: int) -> float:
    """Return that charge at the end of a plan, or the robot's charge then, if that is less."""
    return min(needed(floor, last, i), last.charges[i])


def _plan(floor: Floor, states: Sequence[Joint], begun: float) -> Plan:
    """Return the plan of these states, in which robots leave chargers with the charge and in the
    tick that were planned."""
    plan, _ = plan_of(floor, states[0], [joint.poses for joint in states])
    live = floor.team.live
    ways, at, tick = [[*way] for way in plan.ways], [0] * len(plan.ways), 0.0 if live else 1.0
    for before, joint in pairwise(states):
        moving = [i for i in floor.robots if before.poses[i] != joint.poses[i]]
        for i in moving:
            at[i] += 1
            energy = floor.team.members[i].energy
            if energy is not None and energy.charging(before.poses[i]):
                charge, due = before.charges[i], begun + tick
                ways[i][at[i]] = ways[i][at[i]]._replace(charge=charge, tick=due)
            elif energy is not None:
                charge = joint.charges[i] + energy.battery.move
                ways[i][at[i]] = ways[i][at[i]]._replace(charge=charge)
        tick += _duration(floor.team.step_times, before, joint)
    batteries = {i: e.battery for i in floor.robots if (e := floor.team.members[i].energy)}
    for i in () if any(each.stay for each in batteries.values()) else batteries:
        _needed(floor, states[-1], i, ways[i])
    return Plan(tuple(map(tuple, ways)), plan.foreseen)


def _needed(floor: Floor, last: Joint, i: int, way: list[Waypoint]) -> None:
    """Let a robot leave each charger as soon as it has the charge for its path to the next one, or
    to the end: waiting elsewhere uses no charge."""
    energy = floor.team.members[i].energy
    assert energy is not None
    needed = _needed_at_end(floor, last, i)
    for place in range(len(way) - 1, 0, -1):
        needed = (0 if energy.charging(way[place].pose) else needed) + energy.battery.move
        way[place] = way[place]._replace(charge=needed, tick=0)
