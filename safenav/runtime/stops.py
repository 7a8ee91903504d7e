"""The next stop of a robot with a battery: a pose of its next target, or a charger before it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, partial
from heapq import heappop, heappush
from math import ceil

from msgspec import Struct
from msgspec.structs import replace

from safenav.cached_method import cached_method
from safenav.scenario.model import Battery
from safenav.world.poses import FAR, Mask, PoseGraph, bits

NEVER = 1 << 40
"""No charge suffices."""


SPARE = 4
"""Reserve of a helper in steps, if other robots can block it."""


class Stops(Struct, frozen=True, eq=False, dict=True):
    """The stops of one robot on one floor. ``targets`` (pose masks) are met in turn; ``full``: it
    charges fully, since other robots or its formula can delay it; ``settles``: it stays at the last
    target. ``afterwards`` (of a duty, the only target): the need of each of its poses
    afterwards."""

    graph: PoseGraph
    targets: tuple[Mask, ...]
    allowed: Mask
    chargers: Mask
    battery: Battery
    full: bool = False
    settles: bool = False
    afterwards: Mapping[int, int] | None = None

    @cached_property
    def needs(self) -> tuple[dict[int, int], ...]:
        """Return for each next target the need of each pose from which some charge suffices: the
        least charge with which the robot can continue forever. More charge is never worse, so one
        number per pose suffices, without a product with the charge: ``need_k(p)`` is the least over
        steps p -> q of ``move`` + (``need_{k+1}(q)`` if q is target k, else ``need_k(q)``), and 0
        at a charger if the charge for leaving it is at most the capacity; the greatest fixpoint of
        that. Where staying meets a target, a strategy may step to another of its poses instead."""
        before: dict[int, list[int]] = {pose: [] for pose in bits(self.allowed)}
        for pose in before:
            for step in self.graph.steps(pose):
                if step in before:
                    before[step].append(pose)
        if self.afterwards is not None:
            return (self._leg(before, 0, self.afterwards),)
        turns = range(len(self.targets))
        found = tuple(dict.fromkeys(before, 0) for _ in turns)
        while True:
            then = [found[self.turn(k + 1)] for k in turns]
            after = map(partial(self._leg, before), turns, then)
            grown = tuple(
                {pose: max(new[pose], old[pose]) for pose in new if pose in old}
                for new, old in zip(after, found, strict=True)
            )
            if grown == found:
                return found
            found = grown

    def _leg(
        self, before: dict[int, list[int]], turn: int, then: Mapping[int, int]
    ) -> dict[int, int]:
        """The charge of each pose for a path to the target plus the need there; 0 at chargers."""
        best: dict[int, int] = {}
        queue: list[tuple[int, int]] = []

        def offer(pose: int, charge: int) -> None:
            if charge > self.battery.capacity:
                return
            if self.chargers >> pose & 1:
                charge = 0
            if charge < best.get(pose, NEVER):
                best[pose] = charge
                heappush(queue, (charge, pose))

        for pose in bits(self.targets[turn] & self.allowed):
            if pose not in then:
                continue
            for former in before[pose]:
                offer(former, then[pose] + self.battery.move)
            aside = self._other_pose_charge(pose, turn, then)
            if self.chargers >> pose & 1:
                offer(pose, max(then[pose], aside))
            else:  # without charge for a step it is out of service, and meets nothing by staying
                offer(pose, max(then[pose] + ceil(self.battery.stay), self.battery.move, aside))
        while queue:
            charge, pose = heappop(queue)
            if charge == best[pose]:
                for former in before[pose]:
                    offer(former, charge + self.battery.move)
        return best

    def _other_pose_charge(self, pose: int, turn: int, then: Mapping[int, int]) -> int:
        """Return the charge for a step to another pose of a target, which a strategy may take where
        staying meets the target; 0 if the robot settles there. ``then``: the needs afterwards."""
        after = self.turn(turn + 1)
        if self._shortest or self.afterwards is not None or (self.settles and after == turn):
            return 0
        if self.chargers == self.allowed:
            return 0
        goes_on, goal = self._on_chargers.needs[after], self.targets[turn]
        steps = (at for at in self.graph.steps(pose) if goal >> at & 1 and at in goes_on)
        return max((then.get(at, NEVER) + self.battery.move for at in steps), default=0)

    def turn(self, index: int) -> int:
        """The number of the next target after ``index`` targets."""
        return min(index, len(self.targets) - 1) if self.settles else index % len(self.targets)

    def need(self, pose: int, turn: int) -> int:
        """The least charge with which it can continue from a pose, with target ``turn`` next."""
        return self.needs[turn].get(pose, NEVER)

    def needed(self, pose: int, turn: int) -> int:
        """The same, but 0 for an unknown pose, which may be open by then."""
        return self.needs[turn].get(pose, 0)

    def charge_after(self, charge: int, pose: int, *, moves: bool) -> int:
        """The charge in a pose after a step there, or a stay: on a charger it waits until full."""
        if self.chargers >> pose & 1:
            return self.battery.capacity
        return charge - self.battery.move if moves else charge

    def takes_way(self, path: Sequence[int], turn: int) -> int:
        """The charge for a path (poses) to its next charger, or to its end plus the need there with
        target ``turn`` next."""
        for steps, pose in enumerate(path[1:], 1):
            if self.chargers >> pose & 1:
                return steps * self.battery.move
        return (len(path) - 1) * self.battery.move + self.need(path[-1], turn)

    def for_duty(self, goal: Mask, turn: int) -> Stops | None:
        """The stops of a helper: its duty is its next target, then target ``turn``. It can reach a
        charger afterwards, since it may help again, with SPARE steps left if others can block it.
        Reserves that a full battery does not cover are dropped; None if it does not even suffice
        without them."""
        back = self.graph.distances(self.chargers & self.allowed, self.allowed)
        move, needs = self.battery.move, self.needs[turn]
        returns = {pose: max(need, back[pose] * move) for pose, need in needs.items()}
        least = returns, needs
        spared = [{at: need + SPARE * move for at, need in each.items()} for each in least]
        for each in (*(spared if self.full else ()), *least):
            found = replace(self, targets=(goal,), settles=False, afterwards=each)
            if any(found.need(at, 0) == 0 for at in bits(self.chargers)):
                return found
        return None

    def _need_after_target(self, pose: int, turn: int) -> int:
        """The need of a pose in which target ``turn`` has been met."""
        if self.afterwards is not None:
            return self.afterwards.get(pose, NEVER)
        return self.need(pose, self.turn(turn + 1))

    def next(
        self,
        pose: int,
        turn: int,
        charge: float,
        kept: Mask = 0,
        taken: Mask = 0,
        *,
        helps: bool = False,
    ) -> int | None:
        """The next pose to visit: of the target, if a strategy for all targets could leave too
        little charge after it; or of a charger, or one from which to enter it. None if the charge
        suffices for a strategy for all targets, or if no stop helps. ``kept``: the poses in regions
        that others do not leave, chosen last; ``taken``: those in regions where others are or go to
        charge, chosen after free ones equally near the target; ``helps``: its strategy is not for
        these targets alone."""
        takes = self._path_charges(pose, turn)
        met, charges = self.targets[turn] >> pose & 1, self.chargers >> pose & 1
        direct = charges and not (met or helps or self._shortest)  # it could return repeatedly
        enough = self.goes_on_with(pose, turn) <= charge
        if enough and not direct:
            return None
        if met and charges and self._stays(pose, turn) <= self.battery.capacity:
            return pose  # its goal counts once the charge suffices
        place = min(takes, key=lambda at: (kept >> at & 1, takes[at], at), default=None)
        if place is not None and takes[place] <= charge:
            return self._entry(pose, place)
        hops = self._hop(turn)
        able = [
            at
            for at in bits(self.chargers)
            if self.steps(pose, at) * self.battery.move <= charge and self.need(at, turn) == 0
        ]
        order = {
            at: (kept >> at & 1, hops.get(at, NEVER), taken >> at & 1, self.steps(pose, at), at)
            for at in able
        }
        place = min(order, key=lambda at: order[at], default=None)
        if place in (None, pose):  # with a full battery nothing is gained by a longer stay
            return pose if charges and charge < self.battery.capacity else None
        return self._entry(pose, place)

    def goes_on_with(self, pose: int, turn: int) -> int:
        """Return the least charge with which a robot continues in a pose; with less it charges
        first."""
        takes = self._path_charges(pose, turn)
        return max(self._nearest(pose, turn, takes), self._any_step(pose, turn))

    def steps(self, pose: int, at: int) -> int:
        """The steps to a pose; FAR for none."""
        return self.graph.distances(1 << at, self.allowed)[pose]

    def reachable(self, pose: int, places: Mask) -> Mask:
        """Those of some poses to which there is a path."""
        return places & self.graph.closure(1 << pose, self.allowed)

    def nearest(self, pose: int, places: Mask) -> int:
        """The steps to the nearest of some poses; FAR for none."""
        found = self.graph.steps_between(1 << pose, places & self.allowed, self.allowed)
        return FAR if found is None else found

    def _entry(self, pose: int, at: int) -> int:
        """Return the first pose to visit on the path to ``at``. A strategy for ``at`` enters its
        region in that pose only; if the path enters the region in another one, the pose after that
        is first."""
        first, here, size = at, pose, self.graph.size
        while here != at:
            near = (step for step in self.graph.steps(here) if self.allowed >> step & 1)
            after = min(near, key=lambda step: (self.steps(step, at), step))
            if here != pose and here % size == at % size:
                first = after
            here = after
        return first if first == at else self._entry(pose, first)

    def wanted(self, pose: int, turn: int) -> int:
        """Return the charge with which to leave a stop: enough for the next target, otherwise for
        the next charger before it; 0 off the chargers."""
        if not self.chargers >> pose & 1:
            return 0
        hops, capacity = self._hop(turn), self.battery.capacity
        own = hops.get(pose, NEVER)
        if self.full:
            return capacity
        if own == 0:
            stays = self._stays(pose, turn)
            return stays if stays <= capacity else min(self._direct(pose, turn), capacity)
        nearer = [self.steps(pose, at) for at, hop in hops.items() if hop < own]
        return min(min(nearer, default=NEVER) * self.battery.move, capacity)

    def _nearest(self, pose: int, turn: int, takes: dict[int, int]) -> int:
        """The charge for meeting the next target in any of its nearest poses, including the need
        there."""
        if self.targets[turn] >> pose & 1:
            return self._stays(pose, turn)
        near = min((self.steps(pose, at) for at in takes), default=NEVER)
        nearest = (takes[at] for at in takes if self.steps(pose, at) == near)
        return max(nearest, default=NEVER)

    def _any_step(self, pose: int, turn: int) -> int:
        """The charge that suffices after any step of a strategy. The strategy minimizes the steps
        to the first of its targets that it met last, over all others: where these have several
        poses, the legs between are not the shortest. It never steps to a pose from which it cannot
        meet them forever. Where it meets a target by staying, it may also leave and meet it on its
        way; a charger supplies the charge for that."""
        goal, then = self.targets[turn], self.turn(turn + 1)
        if self._shortest or self.afterwards is not None:
            return 0
        met, charges = goal >> pose & 1, self.chargers >> pose & 1
        aside = self._other_pose_charge(pose, turn, self.needs[then]) if met else 0
        if met and (not charges or (self.settles and then == turn)):
            return aside
        goes_on = self._on_chargers.needs
        turns = ((at, then if goal >> at & 1 else turn) for at in self.graph.steps(pose))
        needs = (self.need(at, k) for at, k in turns if at in goes_on[k])
        least = max((need + self.battery.move for need in needs), default=0)
        return max(aside, min(least, self.battery.capacity)) if met else least

    @cached_property
    def _on_chargers(self) -> Stops:
        """The same with chargers everywhere: a pose needs no charge if the robot can continue from
        it."""
        return replace(self, chargers=self.allowed)

    @property
    def _shortest(self) -> bool:
        """Whether each target has one pose: then all legs of a strategy are the shortest."""
        return not any(target & (target - 1) for target in self.targets)

    def _direct(self, pose: int, turn: int) -> int:
        """The charge for meeting the next target in its best pose, including the need there."""
        return min(self._stays(pose, turn), *self._path_charges(pose, turn).values(), NEVER)

    def _stays(self, pose: int, turn: int) -> int:
        """The same by staying a tick in ``pose``; NEVER if the target does not include it."""
        if not self.targets[turn] >> pose & 1:
            return NEVER
        then, aside = self._need_after_target(pose, turn), self._any_step(pose, turn)
        if self.chargers >> pose & 1:
            return max(then, aside)
        return max(then + ceil(self.battery.stay), self.battery.move, aside)

    def _path_charges(self, pose: int, turn: int) -> dict[int, int]:
        """Return for each other reachable pose of the next target the charge for the path and the
        need there."""
        move = self.battery.move
        steps_to = {at: self.steps(pose, at) for at in bits(self.targets[turn] & self.allowed)}
        return {
            at: n * move + self._need_after_target(at, turn)
            for at, n in steps_to.items()
            if 0 < n < FAR
        }

    @cached_method
    def _hop(self, turn: int) -> dict[int, int]:
        """Return for each charger the number of further charging stops before the next target."""
        places = list(bits(self.chargers & self.allowed))
        capacity, move = self.battery.capacity, self.battery.move
        hops = {p: 0 for p in places if self._direct(p, turn) <= capacity}
        last: dict[int, int] = {}
        while hops != last:
            last = dict(hops)
            for place in places:
                near = [h for at, h in last.items() if self.steps(place, at) * move <= capacity]
                if place not in hops and near:
                    hops[place] = min(near) + 1
        return hops
