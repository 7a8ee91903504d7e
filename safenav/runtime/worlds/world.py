"""The simulated actual world of a scenario, and the progress of its obstacles.

The modelled world is the map with its known obstacles O; the actual one also holds the hidden
obstacles R, found when a robot is about to enter one (paper, Sections III and V-A).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Protocol

from msgspec import Struct, field

from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.needs import group_of
from safenav.world.map import Region
from safenav.world.moves import Pose


class Change(Struct, frozen=True):
    """An obstacle that appeared, or disappeared without being resolved. ``by_user``: a user who
    watches the run caused it. ``truth``: revealed by resolving it; ``another``: it differs from
    that of the last obstacle of this name."""

    obstacle: Obstacle
    appeared: bool
    by_user: bool = False
    truth: bool | None = None
    another: bool = False


class ChangingWorld(Protocol):
    """A world in which obstacles appear and disappear."""

    def changes(self, tick: int, occupied: Collection[Region]) -> Iterable[Change]:
        """Return the obstacles that appeared or disappeared by the beginning of a tick.
        ``occupied``: the regions in which robots stand or which they are entering; nothing may
        appear there."""


class InputWorld(Protocol):
    """A world that sets the inputs of the scenario."""

    def inputs(self, tick: int) -> Mapping[str, bool]:
        """Return the inputs of a tick; those that are missing stay as they are."""


class Work(Struct):
    """Progress of an obstacle: the next need, and the robots that fulfilled their part of it;
    ``groups``: the robots that fulfilled each need before it."""

    obstacle: Obstacle
    need: int = 0
    done: frozenset[str] = frozenset()
    groups: tuple[tuple[str, ...], ...] = ()

    @property
    def helped(self) -> tuple[str, ...]:
        """Return all participants."""
        return tuple(dict.fromkeys(name for group in self.groups for name in group))

    @property
    def finished(self) -> bool:
        return self.need >= len(self.obstacle.needs)

    @property
    def takes(self) -> bool:
        """Whether the robots that meet the next need carry a load from then on."""
        return not self.finished and self.obstacle.type.takes(self.need)

    @property
    def is_taken_whole(self) -> bool:
        """Whether one robot, or all of a group in one turn, take the whole load."""
        need = self.obstacle.needs[min(self.need, len(self.obstacle.needs) - 1)]
        return need.robots == 1 or need.together

    @property
    def carriers(self) -> Collection[str]:
        """The robots that carry the load: those that took it or their part of it; none if it is not
        a load. The world reports whether it has been put down."""
        number = min(self.need, len(self.obstacle.needs) - 1)
        if self.obstacle.needs[number].same:
            return self.groups[number - 1]
        return self.done if self.takes else ()


Takers = Mapping[str, Collection[str]]
"""For names of loads, the only robots that take them."""
NO_TAKERS: Takers = {}


class Works(Struct):
    """The obstacles in a world by name, with their progress. ``others``: further ones, whose loads
    count as carried. ``takers``: for some loads, the only robots that take them."""

    scenario: Scenario
    open: dict[str, Work] = field(default_factory=dict)
    others: Mapping[str, Work] = field(default_factory=dict)
    takers: Takers = NO_TAKERS

    def perform(
        self, robot: Robot, regions: Mapping[str, Region], cleared: Collection[str] = ()
    ) -> list[Work]:
        """Let ``robot`` do all that it can where it stands, with the others in their ``regions``;
        return the obstacles that this resolves. ``cleared``: names of the loads that it may
        take. It takes a load last, the first in the order of ``taking``."""
        before = self._here(robot, regions)
        for work in before:
            while not work.takes and self._advance(work, robot, regions, cleared):
                pass
        for work in taking(before):
            while self._advance(work, robot, regions, cleared):
                pass
        return [work for work in before if work.finished]

    def among(self, names: Collection[str] | None) -> Works:
        """Return the same work on the obstacles with these names (None: all)."""
        open_ = {n: work for n, work in self.open.items() if names is None or n in names}
        others = {n: w for n, w in {**self.others, **self.open}.items() if n not in open_}
        return Works(self.scenario, open_, others, self.takers)

    def _advance(
        self, work: Work, robot: Robot, regions: Mapping[str, Region], cleared: Collection[str]
    ) -> bool:
        """Let a robot fulfil the next need of an obstacle; return whether it did and another need
        follows."""
        if work.finished or self._waits(work, cleared) or not self.meet(work, robot, regions):
            return False
        if work.finished:
            del self.open[work.obstacle.name]
        return not work.finished

    def _waits(self, work: Work, cleared: Collection[str]) -> bool:
        return work.takes and work.obstacle.name not in cleared

    def _here(self, robot: Robot, regions: Mapping[str, Region]) -> list[Work]:
        """The obstacles whose next need is fulfilled in a robot's region."""
        here, left = regions.get(robot.name), [w for w in self.open.values() if not w.finished]
        return [work for work in left if here in self.regions(work)]

    def regions(self, work: Work) -> tuple[Region, ...]:
        """The regions where the next need of an obstacle is fulfilled."""
        return work.obstacle.resolution_regions(self.scenario.map, work.need)

    def carries(self, robot: Robot) -> bool:
        """Whether a robot carries a load, and so can take no other."""
        works = {**self.others, **self.open}
        return any(robot.name in work.carriers for work in works.values())

    def within_reach(
        self, robot: Robot, regions: Mapping[str, Region], cleared: Collection[str] = ()
    ) -> list[tuple[Work, tuple[str, ...]]]:
        """The obstacles of which ``robot`` can fulfil a need, or its part of one, where it stands;
        each with the robots that take part. Loads: at most one."""
        here = self._here(robot, regions)
        if not here:
            return []
        found, laden = [], self.carries(robot)
        first = [work for work in here if not work.takes]
        for work in (*first, *taking(here)):
            if work.finished or self._waits(work, cleared) or (work.takes and laden):
                continue
            need = work.obstacle.needs[work.need]
            group = self._group(work, robot, regions)
            new = robot.name in group and robot.name not in work.done
            if new and not (need.together and len(group) < need.robots):
                found.append((work, group if need.together else (robot.name,)))
                laden = laden or work.takes
        return found

    def _group(self, work: Work, robot: Robot, regions: Mapping[str, Region]) -> tuple[str, ...]:
        """The robots that fulfil the next need of an obstacle, or have done their part of it, once
        ``robot`` acts; empty if it cannot act on it."""
        need = work.obstacle.needs[work.need]
        skills = work.obstacle.type.actions(work.need)
        places = self.regions(work)

        def there(other: Robot) -> bool:
            asked = not need.same or other.name in work.groups[work.need - 1]
            if not (asked and skills <= other.capabilities and regions.get(other.name) in places):
                return False
            if not work.takes or other.name in work.done:
                return True
            mine = self.takers.get(work.obstacle.name, (other.name,))
            return other.name in mine and not self.carries(other)

        if not there(robot):
            return ()
        if need.together:
            return tuple(other.name for other in self.scenario.robots if there(other))
        had = work.done | {robot.name}
        return tuple(other.name for other in self.scenario.robots if other.name in had)

    def meet(self, work: Work, robot: Robot, regions: Mapping[str, Region]) -> bool:
        """Let the robot do its part of the next need; return whether that fulfils the need."""
        group = self._group(work, robot, regions)
        done, met = group_of(work.obstacle.needs[work.need], work.done, group)
        if not met:
            work.done = done
            return False
        work.groups = (*work.groups, group)
        work.need, work.done = work.need + 1, frozenset()
        return True


def work_on(obstacle: Obstacle, scenario: Scenario) -> Work:
    """Return the work on an obstacle, with its progress in the run that this one continues. An
    order given in that run appears again in tick 1."""
    before = obstacle.appears is None or (obstacle.ordered and obstacle.appears == 1)
    begun = scenario.begun if before else None
    groups = () if begun is None else begun.met.get(obstacle.name, ())
    return Work(obstacle, len(groups), groups=groups)


def taking(works: Iterable[Work]) -> list[Work]:
    """The loads whose next need is to take them, in the order in which a robot takes them: by type,
    region and number."""
    return sorted((work for work in works if work.takes), key=lambda work: work.obstacle.order)


class SimulatedWorld:
    """The scenario's own hidden obstacles."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._regions = {robot.name: robot.start.region for robot in scenario.robots}
        self.works = Works(scenario)
        self._coming = sorted(
            (o for o in scenario.obstacles if o.appears is not None),
            key=lambda obstacle: obstacle.appears or 0,
        )
        closed = () if scenario.begun is None else scenario.begun.closed
        self._closed: dict[str, Obstacle] = {}
        for obstacle in scenario.obstacles:
            if obstacle.name in closed:
                self._closed[obstacle.name] = obstacle
            elif obstacle.appears is None:
                self.works.open[obstacle.name] = work_on(obstacle, scenario)
        self._truths = {obstacle: obstacle.traversable for obstacle in scenario.obstacles}
        self.truths: dict[str, bool | None] = {}
        for obstacle in sorted(scenario.obstacles, key=lambda each: each.appears or 0):
            self.truths.setdefault(obstacle.name, obstacle.traversable)  # of the first to appear
        self._brought: set[Obstacle] = set()
        self._taken_away: set[str] = set()
        self.cleared: Collection[str] = ()

    def sense(self, robot: Robot, region: Region) -> Obstacle | None:
        del robot  # every robot notices adjacent obstacles
        return self.standing().get(region)

    def move(self, robot: Robot, pose: Pose) -> None:
        self._regions[robot.name] = pose.region

    def set_out(self, robot: Robot) -> None:
        """Record that a robot has departed: it no longer acts in its former region."""
        self._regions.pop(robot.name, None)

    def act(self, robot: Robot) -> list[tuple[Obstacle, bool | None]]:
        done = self.works.perform(robot, self._regions, self.cleared)
        found = (work.obstacle for work in done if self.truths[work.obstacle.name] is False)
        self._closed |= {obstacle.name: obstacle for obstacle in found}
        return [(work.obstacle, self.truths[work.obstacle.name]) for work in done]

    def within_reach(self, robot: Robot) -> list[tuple[Work, tuple[str, ...]]]:
        """The obstacles of which a robot can fulfil a need where it stands, with the robots that
        take part."""
        return self.works.within_reach(robot, self._regions, self.cleared)

    def stands(self, obstacle: Obstacle) -> bool:
        """Whether an obstacle is present and unresolved."""
        return obstacle.name in self.works.open

    def closed_to(self, obstacle: Obstacle, robot: Robot) -> bool:
        """Whether a robot must not enter a present obstacle at its next need."""
        return obstacle.closed_to(robot, self.works.open[obstacle.name].need)

    def times(self) -> list[int]:
        """The ticks at which obstacles appear or disappear."""
        standing = [obstacle.goes for obstacle in self._there()]
        coming = [obstacle.appears for obstacle in self._coming]
        return [tick for tick in (*standing, *coming) if tick is not None]

    def inputs(self, tick: int) -> dict[str, bool]:
        """The values of the inputs in a tick."""
        return {each.name: each.is_on(tick) for each in self._scenario.inputs}

    def standing(self) -> dict[Region, Obstacle]:
        """The present obstacles that robots notice: all except orders."""
        works = self.works.open.values()
        return {w.obstacle.region: w.obstacle for w in works if not w.obstacle.ordered}

    def bring(self, obstacle: Obstacle, truth: bool | None) -> None:
        """Let an obstacle appear at its tick ``appears``, like one of the scenario."""
        assert obstacle.appears is not None
        self._truths[obstacle] = truth
        self._coming.append(obstacle)
        self._coming.sort(key=lambda coming: coming.appears or 0)
        self._brought.add(obstacle)
        self.truths[obstacle.name] = truth

    def place(self, obstacle: Obstacle) -> None:
        """Let an obstacle that blocks no robot appear now, also where a robot stands."""
        self.works.open[obstacle.name] = Work(obstacle)
        self.truths[obstacle.name] = None

    def _fits(self, obstacle: Obstacle, occupied: Collection[Region]) -> bool:
        """Whether an obstacle can appear now; an order also in an occupied region."""
        if obstacle.ordered:
            return obstacle.name not in self.works.open
        return obstacle.region not in occupied and obstacle.region not in self.standing()

    def remove(self, name: str) -> bool:
        """Remove an obstacle immediately; return whether it was unresolved."""
        self._closed.pop(name, None)
        return self.works.open.pop(name, None) is not None

    def take_away(self, name: str) -> None:
        """Remove an obstacle by the next tick, if it is present or would appear."""
        self._taken_away.add(name)
        self._coming = [o for o in self._coming if o.name != name or o not in self._brought]

    def _there(self) -> list[Obstacle]:
        """Return the obstacles that are present, including those found to be untraversable."""
        return [*(work.obstacle for work in self.works.open.values()), *self._closed.values()]

    def changes(self, tick: int, occupied: Collection[Region]) -> list[Change]:
        """Return the changes. Obstacles appear at their tick, or as soon as no robot is there."""
        found = []
        for obstacle in self._there():
            by_user = obstacle.name in self._taken_away
            if by_user or (obstacle.goes is not None and obstacle.goes <= tick):
                self.remove(obstacle.name)
                found.append(Change(obstacle, appeared=False, by_user=by_user))
        self._taken_away.clear()
        for obstacle in list(self._coming):
            assert obstacle.appears is not None
            if obstacle.appears > tick:
                break
            if obstacle.goes is not None and obstacle.goes <= tick:
                self._coming.remove(obstacle)
            elif self._fits(obstacle, occupied):
                self._coming.remove(obstacle)
                self.works.open[obstacle.name] = work_on(obstacle, self._scenario)
                before = self.truths[obstacle.name]
                truth = self._truths.get(obstacle, before)
                self.truths[obstacle.name] = truth
                by_user = obstacle in self._brought
                found.append(Change(obstacle, True, by_user, truth, truth is not before))
        return found
