"""A robot's sight of the map and its beliefs about the other robots: the shaded regions.

The trace records beliefs. Sight is computed from the radius of vision in its header with the
definition that the runtime uses (``safenav.world.sight``); known obstacles that are open at that
tick block the view."""

from __future__ import annotations

from msgspec import Struct

from safenav.cached_method import cached_method
from safenav.run.run import Run
from safenav.run.values import RobotBelief
from safenav.trace.words import regions_words
from safenav.world.map import Region, RegionMap
from safenav.world.poses import bits
from safenav.world.sight import Visibility, visible_from


class Shading(Struct, frozen=True):
    """Knowledge of ``robot`` at one tick. ``sight``: the regions that it sees (None: its vision has
    no limit, or is not recorded); ``beliefs``: its beliefs about other robots, by name."""

    robot: str
    vision: float | None
    sight: frozenset[Region] | None = None
    beliefs: tuple[tuple[str, RobotBelief], ...] = ()


def viewers(run: Run) -> tuple[str, ...]:
    """Return the robots with limited vision or recorded beliefs, in the order of their turns."""
    believing = {pair[0] for pair in run.beliefs}
    return tuple(
        track.name for track in run.robots if track.vision is not None or track.name in believing
    )


def shading_of(run: Run, robot: str, tick: int) -> Shading:
    """Return the robot's sight and beliefs after ``tick``. Raises KeyError for an unknown robot."""
    pairs = (
        (other, changes.at(tick))
        for (viewer, other), changes in run.beliefs.items()
        if viewer == robot
    )
    beliefs = tuple((other, belief) for other, belief in pairs if belief is not None)
    sight = SightCache(run.map).after(run, robot, tick)
    seen = None if sight is None else frozenset(sight)
    return Shading(robot, run.track(robot).vision, seen, beliefs)


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

    @cached_method
    def _view(self, vision: float, closed: frozenset[Region]) -> Visibility:
        return visible_from(self.map, vision, closed)

    def after(self, run: Run, robot: str, tick: int) -> list[Region] | None:
        """Return the regions, ascending, that a robot sees after ``tick``; None without a
        radius."""
        track = run.track(robot)
        if track.vision is None:
            return None
        closed = frozenset(run.hidden[name].region for name in run.closed(tick))
        return [*bits(self._view(track.vision, closed).mask(track.regions[tick]))]
