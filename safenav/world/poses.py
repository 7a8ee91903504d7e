"""Poses of robots, their moves, and reachability (docs/scenario.md; paper, Section VI).

``free``: stay or step to a 4-neighbour. ``heading``: a pose is a region and a heading; stay, step
ahead, or turn 90 degrees and step; never backwards, never a turn on the spot.

In searches a pose is a number, ``heading * size + region`` (free mobility has only heading 0), and
a set of poses is an integer with a bit for each. A whole layer of a search is a few shifts, so
closures, backward reachable sets and live sets of a 32 x 32 map take a fraction of a millisecond.
Results are cached.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from enum import StrEnum
from functools import cached_property, lru_cache

from msgspec import Struct

from safenav.data import cached_method
from safenav.world.map import HEADINGS, Heading, Region, RegionMap


class Mobility(StrEnum):
    FREE = "free"
    HEADING = "heading"


class Pose(Struct, frozen=True):
    """A robot's region and, for heading mobility, its heading."""

    region: Region
    heading: Heading | None = None

    @classmethod
    def of(cls, region: Region, facing: str | None) -> Pose:
        """Return the pose that faces the direction with this name."""
        return cls(region, None if facing is None else HEADINGS[facing])

    @property
    def facing(self) -> str | None:
        """The name of the pose's heading, as in traces."""
        return None if self.heading is None else self.heading.label

    @property
    def place(self) -> tuple[Region, str | None]:
        """The pose's region and the name of its heading, as in traces."""
        return self.region, self.facing


def moves(
    mobility: Mobility, pose: Pose, world: RegionMap, blocked: Collection[Region] = ()
) -> tuple[Pose, ...]:
    """Return all poses after one tick: by a stay, then by steps north, east, south, west.

    ``blocked`` regions are walls for steps (never for stays).
    """
    graph = plain_graph(world, mobility)
    steps = map(graph.pose, graph.steps(graph.number(pose)))
    return (pose, *(step for step in steps if step.region not in blocked))


Mask = int
"""A set of poses (or of regions), one bit each."""

_SHORT = 2048

FAR = 1 << 30
"""The distance of an unreachable pose."""


def bits(mask: Mask) -> Iterator[int]:
    """Yield the members of a set, ascending."""
    if mask.bit_length() > _SHORT:  # long numbers are slow
        text = bin(mask)[:1:-1]
        at = text.find("1")
        while at >= 0:
            yield at
            at = text.find("1", at + 1)
        return
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


def region_mask(regions: Iterable[Region]) -> Mask:
    """Return a set of regions as a mask."""
    found = 0
    for region in regions:
        found |= 1 << region
    return found


class PoseGraph:
    """The poses of one mobility on one map, and the steps between them. ``closed``: steps (pairs of
    poses) that the mobility allows but the graph omits. ``remembers``: whether its numbers
    represent poses and a memory of formulas."""

    def __init__(
        self, world: RegionMap, mobility: Mobility, closed: frozenset[tuple[int, int]] = frozenset()
    ) -> None:
        self.world = world
        self.mobility = mobility
        self.size = world.size
        self.remembers = False
        self.blocks = len(Heading) if mobility is Mobility.HEADING else 1
        self._full = (1 << self.size) - 1
        self._cols = world.cols
        self._west = region_mask(range(0, self.size, world.cols))
        self._east = self._west << world.cols - 1
        digits = bytearray(b"1") * self.size  # linear in its size, unlike `region_mask`
        for wall in world.walls:
            digits[wall] = ord("0")
        self.free_regions = int(digits[::-1], 2)
        self._closed = closed
        self._goes_straight = not closed
        self._narrowed = region_mask(pose for pose, _ in closed)  # starts of closed steps
        self._shunned = region_mask(pose for _, pose in closed)  # ends of closed steps

    @property
    def one_way(self) -> bool:
        """Whether some steps may be irreversible."""
        return self.blocks > 1 or bool(self._closed)

    @property
    def goals(self) -> tuple[Mask, ...]:
        """For each goal of the remembered formulas, the poses that meet it."""
        return ()

    @property
    def stays(self) -> tuple[Mask, ...]:
        """For each goal of the remembered formulas, the poses in which a stay meets it."""
        return ()

    @cached_property
    def everywhere(self) -> Mask:
        """All poses in free regions."""
        return self.poses_on(self.free_regions)

    def poses_on(self, regions: Mask) -> Mask:
        """Return all poses whose region is in a set (a mask)."""
        return sum(regions << block * self.size for block in range(self.blocks))

    def on(self, regions: Iterable[Region]) -> Mask:
        """Return all poses in these regions."""
        return self.poses_on(region_mask(regions))

    def outside(self, regions: Iterable[Region]) -> Mask:
        """Return all poses in free regions other than these."""
        return self.everywhere & ~self.on(regions)

    def on_each(self, targets: Iterable[Iterable[Region]]) -> tuple[Mask, ...]:
        """Return, for each target, the poses in its regions."""
        return tuple(map(self.on, targets))

    def poses(self, mask: Mask) -> frozenset[Pose]:
        """Return the members of a set of poses."""
        return frozenset(map(self.pose, bits(mask)))

    @cached_method
    def left_only(self, pose: int, behind: Region | None = None) -> PoseGraph:
        """Return this graph without steps into ``pose``, and without steps from it except into
        ``behind`` (None: with all of them)."""
        shut = {(former, pose) for former in bits(self.backward(1 << pose))}
        if behind is not None:
            shut |= {(pose, to) for to in self.steps(pose) if to % self.size != behind}
        return PoseGraph(self.world, self.mobility, self._closed.union(shut))

    def regions_of(self, poses: Mask) -> Mask:
        """Return the regions of a set of poses."""
        found = 0
        while poses:
            found |= poses & self._full
            poses >>= self.size
        return found

    def number(self, pose: Pose) -> int:
        if self.mobility is Mobility.FREE or pose.heading is None:
            return pose.region
        return int(pose.heading) * self.size + pose.region

    def memory(self, number: int) -> Mapping[str, int]:
        """Return the formula memory in a pose's number."""
        del number
        return {}

    def moved(self, number: int, pose: Pose) -> int:
        """Return the number of a robot at ``number`` after an operator has put it into ``pose``."""
        del number
        return self.number(pose)

    def strayed(self, number: int, pose: Pose) -> int:
        """Return the number of a robot whose step from ``number`` ends in ``pose`` instead."""
        return self.moved(number, pose)

    def pose(self, number: int) -> Pose:
        heading, region = divmod(number, self.size)
        return Pose(region, Heading(heading) if self.mobility is Mobility.HEADING else None)

    @cached_method
    def steps(self, pose: int) -> tuple[int, ...]:
        """Return the poses one step away from a pose, in the order north, east, south, west,
        without the stay."""
        after = []
        facing, region = divmod(pose, self.size)
        for heading in Heading:
            if self.blocks > 1 and heading is Heading(facing).opposite:
                continue
            beside = self.world.step(region, heading)
            if beside is not None and beside not in self.world.walls:
                step = beside + heading * self.size if self.blocks > 1 else beside
                if (pose, step) not in self._closed:
                    after.append(step)
        return tuple(after)

    def forward(self, poses: Mask) -> Mask:
        """Return the poses one step away from some of ``poses``, within the map's walls."""
        narrowed = poses & self._narrowed
        found = self._forward(poses ^ narrowed)
        for pose in bits(narrowed):
            for step in self.steps(pose):
                found |= 1 << step
        return found

    def backward(self, poses: Mask) -> Mask:
        """Return the poses from which one step reaches some of ``poses``."""
        shunned = poses & self._shunned
        found = self._backward(poses ^ shunned)
        for step in bits(shunned):
            for pose in bits(self._backward(1 << step) & ~found):
                if (pose, step) not in self._closed:
                    found |= 1 << pose
        return found

    @cached_method
    def closure(self, start: Mask, allowed: Mask) -> Mask:
        """Return the poses reachable from ``start`` through ``allowed`` poses. ``start`` itself is
        always included."""
        return self._grown(self.forward, start, allowed, back=False)

    @cached_method
    def back(self, goal: Mask, allowed: Mask) -> Mask:
        """Return the poses from which ``goal`` can be reached through ``allowed`` poses. ``goal``
        itself is always included."""
        return self._grown(self.backward, goal, allowed, back=True)

    def around(self, pose: Mask, allowed: Mask) -> Mask:
        """Return the poses reachable from ``pose`` that also have a path to ``pose``."""
        return self.back(pose, self.closure(pose, allowed))  # paths back never leave this set

    @cached_method
    def live(self, targets: tuple[Mask, ...], allowed: Mask) -> Mask:
        """Return the greatest set of ``allowed`` poses from which a robot can visit every target
        infinitely often without leaving the set."""
        found = allowed
        while True:
            before = found
            for target in targets:
                found = self.back(target & found, found)
            if found == before:
                return found

    def where_met(self, meets: Callable[[int, int], bool]) -> Mask:
        """Return the poses that meet a goal about steps: a stay there meets it, or a step into the
        pose does although a stay at neither of its ends does."""
        poses = list(bits(self.everywhere))
        staying = {pose for pose in poses if meets(pose, pose)}
        entered = {
            step
            for pose in poses
            if pose not in staying
            for step in self.steps(pose)
            if step not in staying and meets(pose, step)
        }
        return sum(1 << pose for pose in staying | entered)

    def steps_through(self, start: Mask, goals: Sequence[Mask], allowed: Mask) -> int:
        """Return the steps of a shortest path that visits each goal in turn; FAR without a path."""
        waves, seen, count = [start, *(0 for _ in goals)], [0] * (len(goals) + 1), 0
        while any(waves):
            for k, goal in enumerate(goals):
                waves[k + 1] |= waves[k] & goal & ~seen[k + 1]
            if waves[-1]:
                return count
            seen, count = [old | waves[k] for k, old in enumerate(seen)], count + 1
            waves = [self.forward(new) & allowed & ~seen[k] for k, new in enumerate(waves)]
        return FAR

    def nearest(self, start: int, goal: Mask, allowed: Mask) -> Mask:
        """Return the poses of ``goal`` in one of its nearest regions; all if there is no path."""
        found = frontier = 1 << start
        while frontier and not frontier & goal:
            frontier = self.forward(frontier) & (allowed | goal) & ~found
            found |= frontier
        regions = self.regions_of(frontier & goal)
        return goal & self.poses_on(regions & -regions) if regions else goal

    @cached_method
    def distances(self, goal: Mask, allowed: Mask) -> list[int]:
        """Return, for each pose, the steps to the nearest pose of ``goal``; FAR without a path."""
        field = [FAR] * (self.size * self.blocks)
        found = frontier = goal
        count = 0
        while frontier:
            for pose in bits(frontier):
                field[pose] = count
            count += 1
            frontier = self.backward(frontier) & self.everywhere & ~found
            found |= frontier
            frontier &= allowed
        return field

    def _forward(self, poses: Mask) -> Mask:
        if self.blocks == 1:
            found = self._shift(poses, 0) | self._shift(poses, 1)
            return (found | self._shift(poses, 2) | self._shift(poses, 3)) & self.free_regions
        before = enumerate(_turned(self._facing(poses)))
        return self._joined([self._shift(regions, heading) for heading, regions in before])

    def _backward(self, poses: Mask) -> Mask:
        if self.blocks == 1:
            return self._forward(poses)  # every step is reversible
        after = enumerate(self._facing(poses))
        return self._joined(_turned([self._shift(regions, (h + 2) % 4) for h, regions in after]))

    def _facing(self, poses: Mask) -> list[Mask]:
        """Return the regions of the poses with each heading, by heading (inverse: ``_joined``)."""
        return [poses >> heading * self.size & self._full for heading in range(4)]

    def _joined(self, regions: list[Mask]) -> Mask:
        free = self.free_regions
        return sum((each & free) << heading * self.size for heading, each in enumerate(regions))

    def _grown(
        self, step: Callable[[Mask], Mask], start: Mask, allowed: Mask, *, back: bool
    ) -> Mask:
        """Return the least set with ``start`` that steps into ``allowed`` poses never leave."""
        found = frontier = start
        while frontier:
            frontier = step(frontier) & allowed & ~found
            if frontier and self._goes_straight:
                frontier = self._straight(frontier, allowed & ~found, back)
            found |= frontier
        return found

    def _straight(self, poses: Mask, allowed: Mask, back: bool) -> Mask:
        """Return ``poses`` and the ``allowed`` poses that straight paths from them reach (``back``:
        from which such paths reach them). Each pass doubles the length: up to 2, 4, 8, ..."""
        found = 0
        for heading in range(4):
            block = heading * self.size if self.blocks > 1 else 0
            ways = (heading + 2) % 4 if back else heading
            edge = (0, self._west, 0, self._east)[ways]  # no step from the neighbouring row
            length, far = (self._cols, self.size) if ways % 2 == 0 else (1, self._cols)
            reached = poses >> block & self._full
            through = allowed >> block & self._full & ~edge
            while length < far and reached:
                if ways in (1, 2):
                    reached |= reached << length & through
                    through &= through << length
                else:
                    reached |= reached >> length & through
                    through &= through >> length
                length *= 2
            found |= reached << block
        return found

    def _shift(self, regions: Mask, heading: int) -> Mask:
        if heading == 0:
            return regions >> self._cols
        if heading == 1:
            return (regions & ~self._east) << 1
        if heading == 2:
            return regions << self._cols
        return (regions & ~self._west) >> 1


def _turned(facing: list[Mask]) -> list[Mask]:
    """Return, for each heading, the regions with it or a heading a quarter turn from it."""
    north, east, south, west = facing
    return [west | north | east, north | east | south, east | south | west, south | west | north]


plain_graph = lru_cache(maxsize=64)(PoseGraph)
"""The cached graph of a mobility on a map."""
