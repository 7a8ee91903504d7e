"""Traffic: one direction at a time through corridors that are one region wide.

Two robots that meet head-on in such a corridor can only back out, and one with heading mobility
cannot even do that. So a robot in front of a corridor waits while another one is in it that did
not enter at the same end. The rule acts through what a robot observes: the mouth counts as
occupied, which is all that its specification knows of others, so every guarantee stands.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from safenav.runtime.state import TeamState
from safenav.scenario.model import Robot
from safenav.world.map import Region, RegionMap


@dataclass(frozen=True)
class Corridor:
    """A maximal chain of regions without room to pass; ``ends`` are its outermost regions that
    border on anything else (one in a blind alley)."""

    regions: frozenset[Region]
    ends: frozenset[Region]


def corridors(world: RegionMap) -> dict[Region, Corridor]:
    """The corridor of each region that is in one.

    A region is narrow if at most two free regions border on it and these do not border on a
    common region beside it (else there is a way around a robot that stands there).
    """
    narrow = {region for region in world.free if _narrow(region, world)}
    found: dict[Region, Corridor] = {}
    for region in sorted(narrow):
        if region in found:
            continue
        chain = {region}
        queue = [region]
        while queue:
            for beside in world.neighbours(queue.pop()):
                if beside in narrow and beside not in chain:
                    chain.add(beside)
                    queue.append(beside)
        ends = {r for r in chain if any(n not in chain for n in world.neighbours(r))}
        corridor = Corridor(frozenset(chain), frozenset(ends))
        found.update((r, corridor) for r in chain)
    return found


def _narrow(region: Region, world: RegionMap) -> bool:
    beside = world.neighbours(region)
    if len(beside) > 2:
        return False
    if len(beside) < 2:
        return True
    one, other = (set(world.neighbours(n)) - {region} for n in beside)
    return one.isdisjoint(other)


class Traffic:
    """Knows at which end each robot entered the corridor that it is in."""

    def __init__(self, state: TeamState) -> None:
        self._state = state
        self._corridors = corridors(state.scenario.map)
        self._entered: dict[str, tuple[Corridor, Region | None]] = {}
        for robot in state.scenario.robots:
            self.note(robot)

    def note(self, robot: Robot) -> None:
        """Take note of where a robot is, or is on its way to."""
        region = self._state.next_pose(robot).region
        corridor = self._corridors.get(region)
        if corridor is None:
            self._entered.pop(robot.name, None)
            return
        known = self._entered.get(robot.name)
        if known is None or known[0] is not corridor:
            came = self._state.tick > 0
            self._entered[robot.name] = (corridor, region if came else None)

    def in_the_way(self, robot: Robot) -> tuple[str, ...]:
        """The robots in corridors that are closed to ``robot``."""
        closed = self.closed_to(robot)
        found = [n for mouth in closed for n in self._inside(self._corridors[mouth])]
        return tuple(name for name in dict.fromkeys(found) if name != robot.name)

    def closed_to(self, robot: Robot) -> frozenset[Region]:
        """The neighbouring mouths that ``robot`` must not enter now."""
        state = self._state
        here = state.region(robot)
        own = self._corridors.get(here)
        return frozenset(
            mouth
            for mouth in state.scenario.map.neighbours(here)
            if (corridor := self._corridors.get(mouth)) is not None
            and corridor is not own
            and self._oncoming(robot, corridor, mouth)
        )

    def _oncoming(self, robot: Robot, corridor: Corridor, mouth: Region) -> bool:
        for other in self._inside(corridor):
            if other == robot.name:
                continue
            entered = self._entered[other][1]
            ahead = entered == mouth and len(corridor.ends) > 1
            if not ahead and self._state.scenario.conflict(
                robot, self._state.scenario.robot(other)
            ):
                return True
        return False

    def _inside(self, corridor: Corridor) -> Mapping[str, tuple[Corridor, Region | None]]:
        return {n: entry for n, entry in self._entered.items() if entry[0] is corridor}
