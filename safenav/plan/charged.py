"""Joint plans for which the charges suffice: a search in which each transition takes its ticks.

A robot on a charger charges while it stays, the others use charge while they wait. A transition
lasts as long as its slowest step. A robot enters a region in the transition in which another one
leaves it only if a run would let it: if the other one's turn is earlier, and its step takes one
tick. So a run is never later than the plan, and no robot has less charge than planned.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import cycle, islice, pairwise

from safenav.plan.order import linear, plan_of
from safenav.plan.search import (
    FARTHEST,
    FIRST_BUDGET,
    ONE,
    STATIC,
    Answer,
    Exhausted,
    Goal,
    Guide,
    Search,
)
from safenav.scenario.settings import Clock
from safenav.team.battery import NEVER, dominated
from safenav.team.floor import Floor, Joint
from safenav.team.state import Plan, Waypoint
from safenav.world.poses import Mask

Charges = tuple[float, ...]
WORK, STATES, TRIES = 40_000, 3_000, 12

ACTING = 2
"""Seconds that actions are expected to take in a live run."""
LONG_AGO = -1e9
"""Seconds before any: in a live run a plan sets no time."""


class ChargedSearch(Search):
    """``charges``: those of all robots at the start. ``lasting``: they must suffice
    forever, not only for the plan; ``full``: robots leave chargers with a full battery."""

    def __init__(
        self,
        floor: Floor,
        served: frozenset[int],
        guide: Guide,
        start: Joint,
        seed: int,
        how: tuple[bool, bool],
    ) -> None:
        super().__init__(floor, served, guide, start, seed, WORK)
        self.how, self.team = how, floor.team
        self.live = self.team.scenario.clock is Clock.LIVE
        self.charged = [i for i in floor.robots if self.team.members[i].energy is not None]
        self._best: dict[object, list[Charges]] = {}

    def goal(self, joint: Joint) -> bool:
        return super().goal(joint) and self._fit(joint, final=True)

    def run(self) -> Answer:
        """The plan with the fewest ticks of several."""
        if self.goal(self.start):
            return [self.start]
        if not (all(map(self._suffices, self.charged)) and self._fit(self.start)):
            return None
        best, orders = super().run(), cycle((FARTHEST, STATIC, ONE))
        for how in islice(orders, TRIES):
            if best is None or self.work < WORK // 2:
                break
            found = self.deep(self.start, self.goal, FIRST_BUDGET, how, self._order(how))
            if found is not None and self._ticks(found) < self._ticks(best):
                best = found
        return best

    def _ticks(self, states: Sequence[Joint]) -> int:
        return sum(_lasts(self.floor, before, joint) for before, joint in pairwise(states))

    def _suffices(self, i: int) -> bool:
        """Whether a robot could meet its targets alone: others and open obstacles only restrict
        it. A search would need a third of a second for the same answer."""
        member, (memory, met) = self.team.members[i], self.start.counts[i]
        if member.energy is None or self.floor.is_done(i, (memory, met)):
            return True
        turn, pose = member.energy.turn(memory), self.start.poses[i]
        left = len(member.targets) - turn
        if not member.pursuit.settles:
            left = self.team.rounds * len(member.targets) - met
        least = member.energy.suffices(self.floor.floors[i], turn, left).get(pose, NEVER)
        return bool(least <= self.start.charges[i])

    def deep(self, start: Joint, goal: Goal, budget: int, how: str, order: list[int]) -> Answer:
        self._best = {}
        found = super().deep(start, goal, budget, how, order)
        return None if isinstance(found, Exhausted) else found

    def singles(self, budget: int) -> Answer:
        self._best = {}
        found = super().singles(min(budget, STATES))
        return None if isinstance(found, Exhausted) else found

    def _singles(self, joint: Joint, alive: Sequence[Mask] | None = None) -> Iterator[Joint]:
        del alive
        poses = joint.poses
        if (stay := self._reached(joint, poses)) is not None:
            yield stay
        for i, pose in self.floor.moves(joint):
            if (after := self._reached(joint, (*poses[:i], pose, *poses[i + 1 :]))) is not None:
                yield after

    def _new(self, after: Joint, before: dict[Joint, Joint | None]) -> bool:
        """Whether a state is worth it: no known one differs only by higher charges."""
        return after not in before and not dominated(
            after.charges, self._best.setdefault(after[:3], [])
        )

    def _forced(self, joint: Joint, i: int) -> Iterator[int]:
        """The poses that a robot may take; also its own, where it charges."""
        energy = self.team.members[i].energy
        if energy is not None and energy.chargers >> joint.poses[i] & 1:
            yield joint.poses[i]
        yield from super()._forced(joint, i)

    def _reached(self, joint: Joint, poses: tuple[int, ...]) -> Joint | None:
        poses = self._held(joint, poses)
        moving = [i for i in self.floor.robots if poses[i] != joint.poses[i]]
        ticks = max((self.team.members[i].ticks for i in moving), default=1)
        charges = [*joint.charges]
        for i in self.charged:
            member, charge = self.team.members[i], charges[i]
            assert member.energy is not None
            if i in moving:
                if charge < member.energy.battery.move:
                    return None
                wait = self._waits(i, poses[i], ticks - member.ticks)
                charge = member.energy.stepped(charge) - wait
            elif not member.energy.chargers >> poses[i] & 1:
                charge -= self._waits(i, poses[i], ticks)
            else:
                charge = member.energy.stayed(charge, poses[i], ticks)
            charges[i] = charge
        if poses == joint.poses and charges == [*joint.charges]:
            return None
        after = self.floor.moved(joint, poses, self.floor.robots)
        acts = self.live and after.stages != joint.stages
        acting = self.floor.acting(joint.stages) if acts else 0
        for i in self.charged:
            if acting >> poses[i] % self.team.size & 1:
                charges[i] -= self._waits(i, poses[i], ACTING)
        after = after._replace(charges=tuple(charges))
        return after if self._fit(after) else None

    def _waits(self, i: int, pose: int, ticks: float) -> float:
        """The charge that a robot uses while it stands somewhere."""
        energy = self.team.members[i].energy
        on = energy is None or energy.chargers >> pose & 1
        return 0 if energy is None or on else energy.battery.stay * ticks

    def _held(self, joint: Joint, poses: tuple[int, ...]) -> tuple[int, ...]:
        """The poses, where robots stay that would have to wait for another one to leave."""
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
                    left = found[j] % size != region
                    if not (left and j < i and self.team.members[j].ticks == 1):
                        found[i], again = joint.poses[i], True
                        break
        return tuple(found)

    def _fit(self, joint: Joint, *, final: bool = False) -> bool:
        for i in self.charged:
            energy, pose = self.team.members[i].energy, joint.poses[i]
            assert energy is not None
            least = 0.0
            if self.how[0]:
                turn = energy.turn(joint.counts[i][0])
                allowed = self.floor.allowed(i, joint.stages) if final else self.floor.floors[i]
                least = energy.need(allowed, pose, turn)
            if joint.charges[i] < least:
                return False
        return True

    def _aim(self, joint: Joint, i: int, goal: Mask, *, own: bool) -> Mask:
        energy = self.team.members[i].energy
        if energy is None:
            return goal
        allowed = self.floor.allowed(i, joint.stages)
        if not goal:
            return energy.home(allowed)
        turn = energy.turn(joint.counts[i][0] + own)
        return energy.aim(allowed, goal, turn, (joint.poses[i], joint.charges[i]), self.how)


def _lasts(floor: Floor, before: Joint, joint: Joint) -> int:
    """The ticks of a transition: those of its slowest step."""
    moving = (i for i in floor.robots if before.poses[i] != joint.poses[i])
    return max((floor.team.members[i].ticks for i in moving), default=1)


def charged_plan(floor: Floor, states: Sequence[Joint], begun: float) -> Plan:
    """The plan of these states, in which robots leave chargers with the charge and in the tick that
    were planned. ``begun``: the tick before its first one; live runs have none."""
    begun = LONG_AGO if floor.team.scenario.clock is Clock.LIVE else begun
    plan = plan_of(floor, linear(floor, states[0], [joint.poses for joint in states]))
    ways, at, tick = [[*way] for way in plan.ways], [0] * len(plan.ways), 0
    for before, joint in pairwise(states):
        moving = [i for i in floor.robots if before.poses[i] != joint.poses[i]]
        for i in moving:
            at[i] += 1
            energy = floor.team.members[i].energy
            if energy is not None and energy.chargers >> before.poses[i] & 1:
                charge, due = before.charges[i], begun + 1 + tick
                ways[i][at[i]] = ways[i][at[i]]._replace(charge=charge, tick=due)
        tick += _lasts(floor, before, joint)
    batteries = {i: e.battery for i in floor.robots if (e := floor.team.members[i].energy)}
    for i in () if any(each.stay for each in batteries.values()) else batteries:
        _needed(floor, states[-1], i, ways[i])
    return Plan(tuple(map(tuple, ways)), plan.foreseen, begun + 1 + tick)


def _needed(floor: Floor, last: Joint, i: int, way: list[Waypoint]) -> None:
    """Let a robot leave each charger as soon as it has the charge for its way to the next one, or
    to the end: waiting elsewhere takes none."""
    energy = floor.team.members[i].energy
    assert energy is not None
    need = energy.need(floor.allowed(i, last.stages), last.poses[i], energy.turn(last.counts[i][0]))
    needed = min(need, last.charges[i])
    for place in range(len(way) - 1, 0, -1):
        needed = (0 if energy.chargers >> way[place].pose & 1 else needed) + energy.battery.move
        way[place] = way[place]._replace(charge=needed, tick=0)
