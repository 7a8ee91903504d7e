"""The map: free regions, steps of robots, and reachability.

Regions count from 0 in reading order from the north-west: ``region = row * cols + col``.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from functools import cache
from typing import Any

from safenav.judge.formulas import HEADINGS, Pose

Poses = frozenset[Pose]
Graph = Mapping[Pose, tuple[Pose, ...]]  # the poses after one step from each
MOST_STATES = 1_000_000
"""Maximum number of states of the proofs before the outcome, and of its own proof."""
PER_POSE = 4
"""Cost, in states, of each pose of the map that a proof lists."""


class TooLargeError(Exception):
    """Proofs of a trace, or a part of a bundle, that exceed the limits of the judge."""


class World:
    """The map of a trace. Regions off the map are accepted as arguments; they are not free.
    ``work``: the number of states that proofs have visited."""

    def __init__(self, rows: int, cols: int, walls: Collection[int]) -> None:
        self.cols, self.size, self.work = cols, rows * cols, 0
        self.free = frozenset(range(self.size)).difference(walls)
        self.side, self.steps = cache(self._side), cache(self._steps)
        self.graph = cache(self._graph)

    def _side(self, region: int, to: int) -> str | None:
        """Return the heading of a step between two regions; None if they are not neighbours."""
        return dict(self.steps(True, (region, None))).get(to)

    def _steps(self, faces: bool, pose: Pose) -> tuple[Pose, ...]:
        """Return the poses that one step reaches from a pose. A robot with a heading (``faces``)
        never goes backwards and then faces the direction of its step."""
        (region, heading), found = pose, []
        back = HEADINGS[HEADINGS.index(heading) - 2] if faces and heading else None
        for way, (down, right) in zip(HEADINGS, ((-1, 0), (0, 1), (1, 0), (0, -1)), strict=True):
            to, col = region + down * self.cols + right, region % self.cols + right
            if to in self.free and 0 <= col < self.cols and way != back:
                found.append((to, way if faces else None))
        return tuple(found)

    def _graph(self, faces: bool) -> Graph:
        """Return the poses that one step reaches from each free pose. Raises TooLargeError."""
        headings: Sequence[str | None] = HEADINGS if faces else (None,)
        self.spend(PER_POSE * len(headings) * len(self.free))
        poses = ((region, heading) for region in sorted(self.free) for heading in headings)
        return {pose: self.steps(faces, pose) for pose in poses}

    def spend(self, states: int = 1) -> None:
        """Count the states of a proof. Raises TooLargeError."""
        self.work += states
        if self.work > MOST_STATES:
            raise TooLargeError(f"proofs visit more than {MOST_STATES:,} states")

    def closure(self, starts: Iterable[Any], after: Callable[[Any], Iterable[Any]]) -> set[Any]:
        """Return all states that ``steps`` reach from the given ones. Raises TooLargeError."""
        return {*closure(starts, after, self.spend)}

    def reach(self, graph: Graph, starts: Iterable[Pose], walls: Collection[int]) -> set[Pose]:
        """Return the poses that are reachable without entering ``walls``."""
        return self.closure(
            starts, lambda pose: (q for q in graph.get(pose, ()) if q[0] not in walls)
        )

    def can_continue(
        self,
        graph: Graph,
        starts: Collection[Pose],
        aims: Sequence[AbstractSet[Pose]],
        walls: Collection[int],
    ) -> bool:
        """Return whether a robot in one of the poses can meet every aim infinitely often: some
        reachable poses can reach each other and include a pose of each aim."""
        there, seen = self.reach(graph, starts, walls), set[Pose]()
        before: dict[Pose, list[Pose]] = {}
        for one in there:
            for to in graph.get(one, ()):
                if to in there and to[0] not in walls:
                    before.setdefault(to, []).append(one)
        for pose in there if not aims else there & aims[0]:
            if pose in seen or pose[0] in walls:
                continue
            each = self.closure([pose], lambda one: before.get(one, ()))
            each &= self.reach(graph, [pose], walls)
            if all(aim & each for aim in aims):
                return True
            seen |= each
        return False

    def show(self, region: int) -> str:
        """Return a region for messages: ``47 (3, 8)``."""
        return f"{region} ({', '.join(map(str, divmod(region, self.cols)))})"


def closure(
    starts: Iterable[Any],
    after: Callable[[Any], Iterable[Any]],
    spend: Callable[[], None] = lambda: None,
) -> Iterator[Any]:
    """Yield all states that ``steps`` reach, each before its own steps are computed."""
    found, queue, more = set[Any](), list[Any](), starts
    while True:
        for state in more:
            if state not in found:
                spend()
                found.add(state)
                queue.append(state)
        if not queue:
            return
        yield queue[-1]
        more = after(queue.pop())
