"""Robots that can never move again: a joint state is hopeless long before a search ends.

Two robots with headings that face each other in a corner stay there forever: each can step only
into the other's region. In general these are the greatest set of robots whose steps all lead into a
region of another one of the set, or to a pose from which the robot could not continue forever.
Moves of other robots and disappearing obstacles cannot change that.
"""

from __future__ import annotations

from collections.abc import Sequence

from safenav.team.floor import Floor, Joint
from safenav.world.poses import Mask, region_mask


class Immobile:
    """Finds immobile robots on one floor. ``alive``: the poses from which each robot can continue
    forever once all obstacles are resolved."""

    def __init__(self, floor: Floor, alive: Sequence[Mask]) -> None:
        self._floor, self._alive, self._size = floor, alive, floor.team.size
        self._rivals = [floor.rivals(i) for i in range(len(alive))]
        self._who = [i for i in floor.robots if self._rivals[i]]
        self._ahead: list[dict[int, frozenset[int]]] = [{} for _ in alive]
        self._possible = any(
            floor.graphs[i].one_way or floor.floors[i].bit_count() == 1 for i in self._who
        )

    def hopeless(self, joint: Joint) -> bool:
        """Whether some robot can never complete its mission because others can never move."""
        stuck = self.robots(joint.poses) if self._possible else set()
        return bool(stuck) and any(self._fails(i, joint, stuck) for i in self._floor.robots)

    def robots(self, poses: Sequence[int]) -> set[int]:
        """The robots that can never move again."""
        size = self._size
        taken = {poses[i] % size for i in self._who}
        found = {i for i in self._who if taken.issuperset(self._regions(i, poses[i]))}
        while found:
            blocked = ({poses[j] % size for j in self._rivals[i] & found} for i in found)
            pairs = zip([*found], blocked, strict=True)
            free = {i for i, shut in pairs if not shut.issuperset(self._regions(i, poses[i]))}
            if not free:
                break
            found -= free
        return found

    def _fails(self, i: int, joint: Joint, stuck: set[int]) -> bool:
        floor, pose, count = self._floor, joint.poses[i], joint.counts[i]
        goal = floor.awaited(i, count)
        if floor.is_done(i, count) and (not goal or goal >> pose & 1):
            return False
        if i in stuck:
            return True
        walls = region_mask(joint.poses[j] % self._size for j in self._rivals[i] & stuck)
        allowed = floor.floors[i] & ~floor.graphs[i].poses_on(walls)
        return not floor.graphs[i].back(goal & allowed, allowed) >> pose & 1

    def _regions(self, i: int, pose: int) -> frozenset[int]:
        """The regions into which steps lead that keep a robot alive."""
        known, graph = self._ahead[i], self._floor.graphs[i]
        if pose not in known:
            ahead = (p for p in graph.steps(pose) if self._alive[i] >> p & 1)
            known[pose] = frozenset(p % self._size for p in ahead)
        return known[pose]
