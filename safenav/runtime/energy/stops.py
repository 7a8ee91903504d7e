"""The next stop of a robot with a battery: its next target, or a charger on the way to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field

from safenav.dataclass import dataclass
from safenav.runtime.energy.need import NEVER, Needs, needs
from safenav.scenario.model import Battery
from safenav.world.poses import Mask, PoseGraph, bits


@dataclass(eq=False)
class Stops:
    """The stops of one robot on one floor. ``targets`` (pose masks) are met in turn; ``full``:
    it charges to the full, since others can keep it waiting."""

    graph: PoseGraph
    targets: tuple[Mask, ...]
    allowed: Mask
    chargers: Mask
    battery: Battery
    full: bool = False
    _hops: dict[int, dict[int, int]] = field(default_factory=dict)
    _needs: Needs | None = None

    @property
    def needs(self) -> Needs:
        if self._needs is None:
            found = needs(self.graph, self.targets, self.allowed, self.chargers, self.battery)
            self._needs = found
        return self._needs

    def need(self, pose: int, turn: int) -> int:
        """The least charge with which it can continue from there, target ``turn`` being next."""
        return self.needs[turn].get(pose, NEVER)

    def charger(self, pose: int, turn: int, charge: int) -> int | None:
        """The pose of the charger to go to next; None if the next target can be met directly, or if
        no charger helps."""
        ways = self._ways(pose)
        if self._direct(pose, turn, ways) <= charge:
            return None
        hops = self._hop(turn)
        able = [
            place
            for place in bits(self.chargers)
            if ways.get(place, NEVER) * self.battery.move <= charge and self.need(place, turn) == 0
        ]
        return min(able, key=lambda at: (hops.get(at, NEVER), ways[at], at), default=None)

    def wanted(self, pose: int, turn: int) -> int:
        """The charge with which to leave a charger: enough for the next target, or else for the
        next charger on the way to it."""
        if self.full:
            return self.battery.capacity
        ways, hops = self._ways(pose), self._hop(turn)
        own = hops.get(pose, NEVER)
        if own == 0:
            return min(self._direct(pose, turn, ways), self.battery.capacity)
        nearer = [ways[at] for at, hop in hops.items() if hop < own and at in ways]
        return min(min(nearer, default=NEVER) * self.battery.move, self.battery.capacity)

    def _direct(self, pose: int, turn: int, ways: Mapping[int, int]) -> int:
        """The charge that meeting the next target takes, with what is needed there, in whichever of
        its nearest poses it gets to."""
        goal, then = self.targets[turn], (turn + 1) % len(self.targets)
        if goal >> pose & 1:
            stay = 0 if self.chargers >> pose & 1 else self.battery.stay
            return self.need(pose, then) + stay
        reached = [at for at in bits(goal) if at in ways]
        near = min((ways[at] for at in reached), default=NEVER)
        takes = [ways[at] * self.battery.move + self.need(at, then) for at in reached]
        nearest = [t for at, t in zip(reached, takes, strict=True) if ways[at] == near]
        return max(nearest, default=NEVER)

    def _hop(self, turn: int) -> dict[int, int]:
        """For each charger over how many others the way to the next target leads."""
        if turn in self._hops:
            return self._hops[turn]
        places = list(bits(self.chargers & self.allowed))
        ways = {place: self._ways(place) for place in places}
        capacity = self.battery.capacity
        hops = {p: 0 for p in places if self._direct(p, turn, ways[p]) <= capacity}
        last: dict[int, int] = {}
        while hops != last:
            last = dict(hops)
            for place in places:
                near = [
                    hop
                    for at, hop in last.items()
                    if ways[place].get(at, NEVER) * self.battery.move <= capacity
                ]
                if place not in hops and near:
                    hops[place] = min(near) + 1
        self._hops[turn] = hops
        return hops

    def _ways(self, pose: int) -> dict[int, int]:
        """The steps to each pose."""
        found, frontier, steps = {pose: 0}, 1 << pose, 0
        seen = frontier
        while frontier:
            steps += 1
            frontier = self.graph.forward(frontier) & self.allowed & ~seen
            seen |= frontier
            for at in bits(frontier):
                found[at] = steps
        return found
