"""Needs of obstacles, and obstacles with their open needs."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import takewhile
from typing import NamedTuple


class Need(NamedTuple):
    """An action that ``robots`` of the ``able`` ones perform, each in one of ``regions``.
    ``together``: all in one tick; ``same``: by robots that fulfilled the need before it. The able
    robots also have the actions of the later needs that the same robots must meet. ``cut_off``:
    those that do not take the load, since no path leads them to where it is put down."""

    able: frozenset[str]
    regions: frozenset[int]
    robots: int = 1
    together: bool = False
    same: bool = False
    action: str = ""
    cut_off: frozenset[str] = frozenset()


class OpenObstacle(NamedTuple):
    """An open obstacle. ``stops``: robots that it physically stops; ``left``: its unmet needs, the
    next one first; ``done``: robots that have done their part of the next need; ``barred``: robots
    without a strategy for serving it; ``order``: rank by which robots that can take several loads
    take them; ``stage``: number of its next need; ``failed``: robots whose actions on it have
    failed."""

    name: str
    region: int
    stops: frozenset[str]
    left: tuple[Need, ...]
    done: frozenset[str] = frozenset()
    barred: frozenset[str] = frozenset()
    order: tuple[str, int, int] = ("", 0, 0)
    stage: int = 0
    failed: frozenset[str] = frozenset()

    def closes(self, robot: str) -> bool:
        """Return whether a robot must not enter its region: it is stopped, and does not resolve the
        obstacle by entering, or has failed to."""
        enters = self.entered_by(robot) and robot not in self.failed
        return bool(self.left) and robot in self.stops and not enters

    def entered_by(self, robot: str) -> bool:
        """Return whether a robot alone resolves it by entering its region now."""
        return len(self.left) == 1 and self.ends_by_entering(robot)

    def ends_by_entering(self, robot: str) -> bool:
        """Return whether one robot alone fulfils its last need by entering its region."""
        last = self.left[-1]
        alone = last.robots == 1 and not last.same
        return alone and self.region in last.regions and robot in last.able

    def chain(self) -> tuple[Need, ...]:
        """Return the needs after the next one that the same robots must meet."""
        later = self.left[1:]
        return tuple(takewhile(lambda need: need.same, later))

    def takes(self) -> bool:
        """Return whether the robots that meet the next need then carry a load."""
        return bool(self.chain()) and not self.left[0].same

    def carriers(self) -> frozenset[str]:
        """Return the robots that carry a load: they have taken it, or taken part in that."""
        if self.left and self.left[0].same:
            return self.left[0].able
        return self.done if self.takes() and not self.left[0].together else frozenset()

    def commits(self) -> bool:
        """Return whether meeting the next need determines the robots of a later need."""
        chosen = self.left[0].same and len(self.left[0].able) <= self.left[0].robots
        return bool(self.chain()) and not chosen

    def acted(self, group: Iterable[str]) -> OpenObstacle:
        """Return the obstacle after a group has done its part of the next need."""
        need, done = self.left[0], self.done.union(group)
        met = need.together or len(done) >= need.robots
        return self.advanced(group) if met else self._replace(done=done)

    def advanced(self, group: Iterable[str]) -> OpenObstacle:
        left, met = self.left[1:], self.done.union(group)
        if left and left[0].same:
            left = (left[0]._replace(able=left[0].able & met), *left[1:])
        return self._replace(left=left, done=frozenset(), stage=self.stage + 1)


OpenObstacles = tuple[OpenObstacle, ...]
