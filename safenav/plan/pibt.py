"""PIBT (Okumura et al., 2022): a next joint pose in which robots approach their goals and push each
other."""

from __future__ import annotations

from collections.abc import Sequence
from random import Random

from safenav.team.floor import Floor, Joint
from safenav.world.poses import Mask

Field = Sequence[int] | None
"""For each pose the steps to a robot's goal poses; None: it has no goal, and may be pushed."""


class Proposals:
    """Proposes joint poses on one floor. Robots never exchange places, nor rotate in a circle."""

    def __init__(self, floor: Floor, random: Random, alive: Sequence[int] | None = None) -> None:
        self._alive = alive
        self._floor, self._random, self._size = floor, random, floor.team.size
        self._members = floor.team.members
        self._rivals = [member.rivals for member in self._members]

    def propose(
        self,
        joint: Joint,
        fields: Sequence[Field],
        order: Sequence[int],
        forced: tuple[int, int] | None = None,
    ) -> tuple[int, ...] | None:
        """The next poses; None if a robot can neither move nor stay. ``order``: the robots in the
        order of their choices; ``forced``: a robot that must take a pose."""
        self._joint, self._fields = joint, fields
        self._next: dict[int, int] = {}
        self._entered: dict[int, list[int]] = {}
        self._now: dict[int, list[int]] = {}
        for i in order:
            self._now.setdefault(joint.poses[i] % self._size, []).append(i)
        if forced is not None and not self._place(forced[0], frozenset(), (forced[1],)):
            return None
        for i in order:
            if i not in self._next and not self._place(i, frozenset(), None):
                return None
        return tuple(self._next.get(i, pose) for i, pose in enumerate(joint.poses))

    def _place(self, i: int, pushing: frozenset[int], only: tuple[int, ...] | None) -> bool:
        """Give a robot a pose, and others that are in its way. ``pushing``: the robots that push
        it."""
        mark = len(self._next)
        for pose in only or self._ranked(i):
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
        if self._members[i].zones and self._members[i].shut(self._occupied()) >> region & 1:
            return False
        pushed = []
        if region != self._joint.poses[i] % self._size:
            for j in self._now.get(region, ()):
                if j in rivals:
                    if j in pushing or (j in after and after[j] % self._size == region):
                        return False
                    if j not in after:
                        pushed.append(j)
        self._entered.setdefault(region, []).append(i)
        after[i] = pose
        for j in pushed:
            if j not in after and not self._place(j, pushing | {i}, None):
                return False
            if after[j] % self._size == region:
                return False
        return True

    def _occupied(self) -> list[Mask]:
        """The regions of each robot, before and after this step."""
        size, after, poses = self._size, self._next, enumerate(self._joint.poses)
        return [1 << pose % size | 1 << after.get(j, pose) % size for j, pose in poses]

    def _ranked(self, i: int) -> list[int]:
        """A robot's possible next poses, the nearest to its goals first; free ones before taken
        ones."""
        here, field, rivals = self._joint.poses[i], self._fields[i], self._rivals[i]
        now, size, draw = self._now, self._size, self._random.random
        ranks = [(0 if field is None else field[here], False, draw(), here)]
        for pose in self._floor.steps(i, self._joint.stages)[here]:
            if self._alive is not None and not self._alive[i] >> pose & 1:
                continue
            there = now.get(pose % size)
            taken = there is not None and not rivals.isdisjoint(there)
            ranks.append((1 if field is None else field[pose], taken, draw(), pose))
        ranks.sort()
        return [rank[3] for rank in ranks]
