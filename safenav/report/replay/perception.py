"""A robot's sight of the map and its beliefs about the other robots: the shaded regions.

Beliefs are those that the trace records. Sight is computed from the radius of vision in its header
with the definition that the runtime uses (``safenav.world.sight``); the obstacles that the team
knows at that tick, and has not resolved, block the view."""

from __future__ import annotations

from msgspec import Struct, field

from safenav.report.replay.timeline import ObstacleStatus, Replay, RobotBelief
from safenav.trace.words import regions_words
from safenav.world.map import Region
from safenav.world.poses import bits
from safenav.world.sight import Visibility, visible_from

_CLOSED = {ObstacleStatus.FOUND, ObstacleStatus.REQUESTED, ObstacleStatus.BLOCKED}


class Shading(Struct, frozen=True):
    """Knowledge of ``robot`` at one tick. ``sight``: the regions that it sees (None: its vision has
    no limit, or is not recorded); ``beliefs``: its beliefs about other robots, by name."""

    robot: str
    vision: float | None
    sight: frozenset[Region] | None = None
    beliefs: tuple[tuple[str, RobotBelief], ...] = ()


def viewers(replay: Replay) -> tuple[str, ...]:
    """Return the robots of which there is anything to shade, in the order of their turns."""
    believing = {pair[0] for pair in replay.beliefs}
    return tuple(
        track.name for track in replay.robots if track.vision is not None or track.name in believing
    )


def shading_of(replay: Replay, robot: str, tick: int) -> Shading:
    """Return the robot's sight and beliefs after ``tick``. Raises KeyError for an unknown robot."""
    track = replay.track(robot)
    told = (
        (other, changes.at(tick))
        for (viewer, other), changes in replay.beliefs.items()
        if viewer == robot
    )
    beliefs = tuple((other, belief) for other, belief in told if belief is not None)
    sight = SightCache(replay).mask(robot, tick)
    seen = None if sight is None else frozenset(bits(sight))
    return Shading(robot, track.vision, seen, beliefs)


def shading_lines(shading: Shading) -> list[str]:
    """Return the same in words: ``digit sees 14-16``, ``digit believes quad in 22-24``."""
    lines = []
    if shading.sight is not None:
        lines.append(f"{shading.robot} sees {regions_words(shading.sight)}")
    for other, belief in shading.beliefs:
        verb = "saw" if belief.seen else "believes"
        place = f"{'at' if belief.seen else 'in'} {regions_words(belief.regions)}"
        lines.append(f"{shading.robot} {verb} {other} {place}")
    return lines


class SightCache(Struct):
    """The robots' sight during a run, cached, so that a query for every tick is cheap."""

    replay: Replay
    _views: dict[tuple[float, frozenset[Region]], Visibility] = field(default_factory=dict)

    def mask(self, robot: str, tick: int) -> int | None:
        """Return the robot's sight after ``tick`` as a set in one integer, None without a
        radius."""
        track = self.replay.track(robot)
        if track.vision is None:
            return None
        key = (track.vision, self._closed(tick))
        if key not in self._views:
            self._views[key] = visible_from(self.replay.map, *key)
        return self._views[key].mask(track.regions[tick])

    def _closed(self, tick: int) -> frozenset[Region]:
        replay = self.replay
        return frozenset(
            hidden.region
            for hidden in replay.hidden
            if replay.statuses[hidden.name].at(tick) in _CLOSED
        )
