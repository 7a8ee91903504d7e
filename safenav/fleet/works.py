"""The obstacles that a fleet knows: their next needs, and the robots that did their part."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from msgspec import Struct, field

from safenav.scenario.model import Obstacle, Robot, Scenario
from safenav.scenario.needs import group_of
from safenav.world.map import Region


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


class Works(Struct):
    """The obstacles in a world by name, with their progress. ``others``: further ones, whose loads
    count as carried. ``takers``: for some loads, the only robots that take them."""

    scenario: Scenario
    open: dict[str, Work] = field(default_factory=dict)
    others: Mapping[str, Work] = field(default_factory=dict)

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
        self, robot: Robot, regions: Mapping[str, Region]
    ) -> list[tuple[Work, tuple[str, ...]]]:
        """The obstacles of which ``robot`` can fulfil a need, or its part of one, where it stands;
        each with the robots that take part. Loads: at most one."""
        here = self._here(robot, regions)
        if not here:
            return []
        found, laden = [], self.carries(robot)
        first = [work for work in here if not work.takes]
        for work in (*first, *taking(here)):
            if work.finished or (work.takes and laden):
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
            return not self.carries(other)

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


def taking(works: Iterable[Work]) -> list[Work]:
    """The loads whose next need is to take them, in the order in which a robot takes them: by type,
    region and number."""
    return sorted((work for work in works if work.takes), key=lambda work: work.obstacle.order)
