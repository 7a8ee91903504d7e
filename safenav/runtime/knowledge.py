"""The team's knowledge about obstacles (the paper's environment characterization).

An obstacle that a robot encountered is ``pending`` until it is resolved, disappears, or becomes
permanent (the paper's set O). Its progress follows from the robots' actions since it appeared.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from copy import copy
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from safenav.begun import Begun
from safenav.runtime.worlds.world import NO_TAKERS, Takers, Work, Works, taking, work_on
from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.spec.task import Known
from safenav.world.map import Region

UNTRAVERSABLE = "found to be untraversable"
PERMANENT = "an operator declared it permanent"


class NeedMet(Struct, frozen=True):
    """One of several needs of an obstacle was met by ``group``."""

    obstacle: Obstacle
    need: int
    group: tuple[str, ...]

    @property
    def last(self) -> bool:
        return self.need + 1 == len(self.obstacle.needs)


class Permanent(Struct, frozen=True):
    """An obstacle in O, the reason, and its ``need`` that was open then."""

    obstacle: Obstacle
    reason: str
    need: int

    @property
    def given_up(self) -> bool:
        """Whether no robot can ever resolve it."""
        return self.reason not in (UNTRAVERSABLE, PERMANENT)


class Knowledge:
    """The obstacles that the team knows. Owner of ``pending`` and ``permanent`` ones, by name.
    ``sighted``: obstacles seen by robots that may enter them, and encountered by no other robot.
    ``barred``: (robot, obstacle) where the robot's actions have failed too often."""

    def __init__(self, scenario: Scenario) -> None:
        self.permanent: dict[str, Permanent] = {}
        self.sighted: dict[str, Obstacle] = {}
        self.barred: Collection[tuple[str, str]] = frozenset()
        self._unmet = Works(scenario)
        self._known = Works(scenario, others=self._unmet.open)
        self._finished: dict[str, Work] = {}
        begun = scenario.begun or Begun()
        for obstacle in scenario.obstacles:
            if obstacle.appears is not None:
                continue
            if obstacle.name in begun.closed:
                self.join(obstacle, UNTRAVERSABLE)
            elif _takes_more(obstacle):
                self._unmet.open[obstacle.name] = work_on(obstacle, scenario)

    def copy(self) -> Knowledge:
        """Return an independent copy."""
        other = copy(self)
        other.permanent, other.sighted = dict(self.permanent), dict(self.sighted)
        unmet, known = (
            {name: replace(work) for name, work in works.open.items()}
            for works in (self._unmet, self._known)
        )
        other._unmet = Works(self._unmet.scenario, unmet)
        other._known = Works(self._unmet.scenario, known, unmet)
        return other

    @property
    def pending(self) -> dict[str, Work]:
        """The pending obstacles by name, with their progress."""
        return self._known.open

    def closed_to(self, obstacle: Obstacle, robot: Robot) -> bool:
        """Whether a robot must not enter an obstacle's region now. An obstacle in O is closed to
        every robot that it blocks, an obstacle on which a robot's actions fail to that robot."""
        if self.is_left(obstacle, robot):
            return obstacle.blocks(robot)
        return obstacle.closed_to(robot, self.need_of(obstacle))

    def is_left(self, obstacle: Obstacle, robot: Robot) -> bool:
        """Whether a robot no longer acts on an obstacle: it is in O, or its actions have failed."""
        return obstacle.name in self.permanent or (robot.name, obstacle.name) in self.barred

    def around(self, region: Region, robot: Robot) -> Obstacle | None:
        """Return the unresolved obstacle that stops a robot and into which it has walked to resolve
        it."""
        for obstacle in (*self.obstacles.values(), *self.sighted.values()):
            last = len(obstacle.needs) - 1
            inside = obstacle.region == region and obstacle.blocks(robot)
            if inside and obstacle.resolved_by_entering(robot, last):
                return obstacle
        return None

    def need_of(self, obstacle: Obstacle) -> int:
        """The number of the next need; the last one until the world reports the obstacle
        resolved."""
        work = self.pending.get(obstacle.name) or self._unmet.open.get(obstacle.name)
        return 0 if work is None else min(work.need, len(obstacle.needs) - 1)

    def closing(self, region: Region, robot: Robot) -> Obstacle | None:
        """Return the known obstacle that closes a region to a robot."""
        known = (*self.obstacles.values(), *self.sighted.values())
        here = (obstacle for obstacle in known if obstacle.region == region)
        return next((obstacle for obstacle in here if self.closed_to(obstacle, robot)), None)

    def is_waited_for(self, region: Region) -> bool:
        """Whether an obstacle in a region is pending."""
        return any(work.obstacle.region == region for work in self.pending.values())

    @property
    def obstacles(self) -> dict[str, Obstacle]:
        """Return all known obstacles that are still present: pending ones, then those in O."""
        found = {name: work.obstacle for name, work in self.pending.items()}
        return found | {name: known.obstacle for name, known in self.permanent.items()}

    def sight(self, obstacle: Obstacle) -> None:
        """Remember an obstacle that a robot has sensed and may enter. It stays closed to other
        robots that it blocks, whether or not they sense it."""
        if not self.knows(obstacle):
            self.sighted[obstacle.name] = obstacle

    def meet(self, obstacle: Obstacle) -> bool:
        """Remember an obstacle that a robot encountered; return whether it is new."""
        if obstacle.name in self.pending:
            return False
        work = self._unmet.open.get(obstacle.name) or Work(obstacle)
        self.forget(obstacle)
        self.pending[obstacle.name] = work
        return True

    def perform(
        self,
        robot: Robot,
        regions: Mapping[str, Region],
        cleared: Collection[str] = (),
        only: Collection[str] | None = None,
        takers: Takers = NO_TAKERS,
    ) -> tuple[bool, tuple[NeedMet, ...]]:
        """Record the actions of a robot in its region. Return whether they advanced a pending
        obstacle without resolving it, and the needs fulfilled. ``only``: names of the obstacles on
        which it acts (None: all that it can); ``takers``: for some loads, the only robots that take
        them."""
        before = {name: (work.need, work.done) for name, work in self.pending.items()}
        unmet = self._unmet.among(only)
        works = [*self._known.among(only).open.values(), *unmet.open.values()]
        needs = [work.need for work in works]
        finished = unmet.perform(robot, regions)
        for work in finished:
            del self._unmet.open[work.obstacle.name]
        known = self._known.among(only)
        known.takers = takers
        known.perform(robot, regions, cleared)  # the world reports whether it is resolved
        self._finished = {work.obstacle.name: work for work in finished}
        further = any(
            (work.need, work.done) != before[name]
            for name, work in self.pending.items()
            if not work.finished
        )
        # Loads are put down before others are taken.
        advanced = [pair for pair in zip(works, needs, strict=True) if pair[0].need > pair[1]]
        advanced.sort(key=lambda pair: pair[0].obstacle.type.takes(pair[1]))
        met = tuple(
            NeedMet(work.obstacle, need, work.groups[need])
            for work, first in advanced
            for need in range(first, work.need)
            if len(work.obstacle.needs) > 1
        )
        return further, met

    def affected(self, resolved: Collection[str]) -> set[str]:
        """The names of the obstacles that an action may have affected, given that it resolved those
        in ``told``. Excluded are others that a single action resolves: they may have appeared
        since."""
        names = {*self.pending, *self._unmet.open}
        single = {
            name
            for name, work in self.pending.items()
            if self.need_of(work.obstacle) == len(work.obstacle.needs) - 1
            and work.obstacle.needs[-1].robots == 1
        }
        return names - (single - {*resolved})

    def within_reach(
        self,
        robot: Robot,
        regions: Mapping[str, Region],
        cleared: Collection[str] = (),
        takers: Takers = NO_TAKERS,
    ) -> list[tuple[Obstacle, tuple[str, ...]]]:
        """The pending obstacles of which a robot can fulfil a need, or its part of one, where it
        stands; each with the robots that take part. ``regions``: those of the robots that may;
        ``takers``: as for ``perform``."""
        self._known.takers = takers
        found = self._known.within_reach(robot, regions, cleared)
        return [(work.obstacle, group) for work, group in found]

    def is_being_met(self, obstacle: Obstacle, leads: Collection[str]) -> bool:
        """Whether the actions that ``leads`` have begun on a pending obstacle fulfil its next need,
        so that nothing is left for another robot."""
        work = self.pending[obstacle.name]
        need = obstacle.needs[self.need_of(obstacle)]
        return bool(leads) and (need.together or len(work.done.union(leads)) >= need.robots)

    def to_take(self, sent_for: str | None, left: Collection[str] = ()) -> list[Obstacle]:
        """The pending loads that a robot may take, except those ``left`` (names). If it
        is sent for one of them, it leaves others that it would take as a whole."""
        loads = [work for work in taking(self.pending.values()) if work.obstacle.name not in left]
        sent = next((w for w in loads if w.obstacle.name == sent_for and w.is_taken_whole), None)
        if sent is None:
            return [work.obstacle for work in loads]
        return [sent.obstacle, *(work.obstacle for work in loads if not work.is_taken_whole)]

    def is_laden(self, robot: str) -> bool:
        """Whether a robot carries a load that, as far as the team knows, no robot can ever put
        down."""
        return any(robot in work.carriers for work in self._unmet.open.values())

    def appear(self, obstacle: Obstacle) -> None:
        """Record that an obstacle has appeared; no robot has encountered it."""
        self.forget(obstacle)
        if _takes_more(obstacle):
            self._unmet.open[obstacle.name] = work_on(obstacle, self._unmet.scenario)

    def knows(self, obstacle: Obstacle) -> bool:
        """Whether an obstacle is pending or permanent."""
        return obstacle.name in self.pending or obstacle.name in self.permanent

    def forget(self, obstacle: Obstacle) -> bool:
        """Forget an obstacle that was resolved or disappeared; return whether the team knew it."""
        known, works = self.knows(obstacle), (self.pending, self._unmet.open)
        parts: tuple[dict[str, Any], ...] = self.sighted, self.permanent, *works
        for part in parts:
            part.pop(obstacle.name, None)
        return known

    def helped(self, obstacle: Obstacle) -> tuple[str, ...]:
        """Return the robots that had a part in resolving an obstacle that was just resolved."""
        work = self.pending.get(obstacle.name) or self._finished.get(obstacle.name)
        return work.helped if work is not None else ()

    def join(self, obstacle: Obstacle, reason: str) -> None:
        """Add an obstacle to O for the robots that it blocks."""
        work = self.pending.pop(obstacle.name, None)
        found = Permanent(obstacle, reason, 0 if work is None else work.need)
        self.permanent[obstacle.name] = found
        if work is not None and found.given_up and _takes_more(obstacle):
            self._unmet.open[obstacle.name] = work  # robots may still fulfil parts of it

    def given_up(self) -> dict[str, int]:
        """The obstacles that no robot can ever resolve, and the need that none can fulfil."""
        return {name: known.need for name, known in self.permanent.items() if known.given_up}

    @property
    def standing(self) -> frozenset[Region]:
        """The regions of all obstacles that are known and not removed: they block the view."""
        return frozenset(obstacle.region for obstacle in self.obstacles.values())

    def walls_for(self, robot: Robot, avoid: Collection[str] = ()) -> tuple[Known, ...]:
        """The regions beyond the walls that the robot must not plan through: those that its
        objective forbids, those of permanent obstacles, and those of pending ones in ``avoid``."""
        item = f"robots.{robot.name}.objective.avoid"
        found = [Known(r, item, f"{robot.name} avoids it") for r in robot.objective.avoid]
        found += [
            Known(known.obstacle.region, f"obstacles.{name}", known.reason)
            for name, known in self.permanent.items()
            if known.obstacle.blocks(robot)
        ]
        found += [
            Known(work.obstacle.region, f"obstacles.{name}", "found, and not resolved yet")
            for name, work in self.pending.items()
            if name in avoid and self.closed_to(work.obstacle, robot)
        ]
        return tuple(sorted(found, key=lambda known: known.region))


def _takes_more(obstacle: Obstacle) -> bool:
    """Whether an obstacle may be resolved in part before any robot encounters it."""
    return len(obstacle.needs) > 1 or obstacle.needs[0].robots > 1
