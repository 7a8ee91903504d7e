"""A robot's sight of the map and its beliefs about the other robots: the shaded regions.

The trace records beliefs. Sight is computed from the radius of vision in its header with the
definition that the runtime uses (``safenav.world.sight``); known obstacles that are open at that
tick block the view."""

from __future__ import annotations

from msgspec import Struct

from safenav.cached_method import cached_method
from safenav.report.replay.timeline import ObstacleStatus, Replay, RobotBelief
from safenav.trace.words import regions_words
from safenav.world.map import Region, RegionMap
from safenav.world.poses import bits
from safenav.world.sight import Visibility, visible_from

CLOSED = {ObstacleStatus.FOUND, ObstacleStatus.REQUESTED, ObstacleStatus.BLOCKED}


class Shading(Struct, frozen=True):
    """Knowledge of ``robot`` at one tick. ``sight``: the regions that it sees (None: its vision has
    no limit, or is not recorded); ``beliefs``: its beliefs about other robots, by name."""

    robot: str
    vision: float | None
    sight: frozenset[Region] | None = None
    beliefs: tuple[tuple[str, RobotBelief], ...] = ()


def viewers(replay: Replay) -> tuple[str, ...]:
    """Return the robots with limited vision or recorded beliefs, in the order of their turns."""
    believing = {pair[0] for pair in replay.beliefs}
    return tuple(
        track.name for track in replay.robots if track.vision is not None or track.name in believing
    )


def shading_of(replay: Replay, robot: str, tick: int) -> Shading:
    """Return the robot's sight and beliefs after ``tick``. Raises KeyError for an unknown robot."""
    track = replay.track(robot)
    pairs = (
        (other, changes.at(tick))
        for (viewer, other), changes in replay.beliefs.items()
        if viewer == robot
    )
    beliefs = tuple((other, belief) for other, belief in pairs if belief is not None)
    sight = SightCache(replay.map).after(replay, robot, tick)
    return Shading(robot, track.vision, None if sight is None else frozenset(sight), beliefs)


def shading_lines(shading: Shading) -> list[str]:
    """Return a shading in words: ``digit sees 14-16``, ``digit believes quad in 22-24``."""
    lines = []
    if shading.sight is not None:
        lines.append(f"{shading.robot} sees {regions_words(shading.sight)}")
    for other, belief in shading.beliefs:
        verb = "saw" if belief.seen else "believes"
        place = f"{'at' if belief.seen else 'in'} {regions_words(belief.regions)}"
        lines.append(f"{shading.robot} {verb} {other} {place}")
    return lines


class SightCache(Struct, frozen=True, dict=True):
    """The sight of robots on a map, cached by radius and blocking obstacles, so that a query for
    every tick is cheap."""

    map: RegionMap

    def seen(self, vision: float, closed: frozenset[Region], region: Region) -> list[Region]:
        """Return the regions, ascending, that are visible from a region within ``vision``."""
        return [*bits(self._view(vision, closed).mask(region))]

    @cached_method
    def _view(self, vision: float, closed: frozenset[Region]) -> Visibility:
        return visible_from(self.map, vision, closed)

    def after(self, replay: Replay, robot: str, tick: int) -> list[Region] | None:
        """Return the robot's sight after ``tick``; None without a radius."""
        track = replay.track(robot)
        if track.vision is None:
            return None
        known = ((h.region, replay.statuses[h.name].at(tick)) for h in replay.hidden.values())
        closed = frozenset(region for region, status in known if status in CLOSED)
        return self.seen(track.vision, closed, track.regions[tick])
