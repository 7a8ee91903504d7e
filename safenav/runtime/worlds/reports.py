"""Checks of a world's reports before they are used: whether they are well formed, and whether they
can be true. Any world may report anything."""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise
from math import isfinite
from numbers import Real
from typing import Any

from msgspec.structs import replace

from safenav.runtime.worlds import protocol
from safenav.scenario.model import Obstacle, Robot
from safenav.trace.fields import WrongError, convert, plain
from safenav.world.map import Region, RegionMap
from safenav.world.moves import Mobility, Pose


def is_time(found: Any) -> bool:
    """Whether a value can be a time in seconds."""
    try:
        return isinstance(found, (float, Real)) and isfinite(found)
    except OverflowError:  # an int beyond every float
        return False


def fitted(found: Any, kind: Any) -> Any:
    """Return a value as one of its type, all parts of which have theirs: Python checks neither
    types nor bounds, and accepts ``Obstacle("door", 47)``. Raises ValueError."""
    try:
        return convert(kind, plain(found))
    except (WrongError, TypeError) as error:
        raise ValueError(f"has a wrong part: {error}") from error


def checked_obstacle(found: Obstacle) -> Obstacle:
    """Return an obstacle that can be part of a scenario. Raises ValueError."""
    where = f"the obstacle in region {found.region}"
    try:
        obstacle: Obstacle = fitted(found, Obstacle)
    except ValueError as error:
        raise ValueError(f"{where} {error}") from error
    listed = obstacle.type.listed
    if listed and listed[0].same:
        raise ValueError(f"{where} has no previous need for 'same'")
    if any(need.same and need.robots != last.robots for last, need in pairwise(listed)):
        raise ValueError(f"{where} needs other numbers of robots for a 'same' need")
    return obstacle


def well_formed(event: Any, robots: Collection[str]) -> protocol.WorldEvent:
    """Return a report all parts of which have their types, and that names only known robots.
    Raises ValueError."""
    if not isinstance(event, protocol.WorldEvent):
        raise ValueError(f"{event!r} is not an event")
    if not is_time(event.at):
        raise ValueError(f"its time is {event.at!r}, not seconds")
    if event.command is None and not isinstance(event, protocol.Sensed):
        told = "command=, the number that start or act was given"
        raise ValueError(f"it names no command ({told})")
    try:
        report: protocol.WorldEvent = replace(
            fitted(replace(event, at=0.0), type(event)), at=event.at
        )
    except ValueError as error:
        raise ValueError(f"it {error}") from error
    for name in (getattr(report, "robot", None), getattr(report, "by", None)):
        if name is not None and name not in robots:
            raise ValueError(f"no robot is named {name!r}")
    for obstacle in (
        getattr(event, "obstacle", None),
        *(o for o, _ in getattr(event, "found", ())),
    ):
        if obstacle is not None:
            checked_obstacle(obstacle)
    return report


def claimed(event: protocol.WorldEvent) -> Collection[Region]:
    """The regions in which a report places its robot."""
    pose = getattr(event, "pose", None)
    return getattr(event, "regions", ()) if pose is None else (pose.region,)


def wrong_step(
    event: protocol.WorldEvent, world: RegionMap, robot: Robot, here: Pose, target: Pose
) -> str | None:
    """Return the reason why a well-formed event cannot end a step from ``here`` to ``target``; None
    if it can."""
    match event:
        case protocol.Arrived():
            return None
        case protocol.Lost(regions=regions):
            if not regions:
                return "it names no region in which the robot may be"
            wrong = [region for region in regions if not world.is_free(region)]
            if not wrong:
                return None
            return f"it cannot be lost in region {wrong[0]}, {world.closed_words(wrong[0])}"
        case protocol.Blocked(pose=pose) if pose.region != here.region:
            return f"blocked, but not back in region {here.region}"
        case protocol.Blocked(obstacle=Obstacle(name=name, region=region)) if (
            region != target.region
        ):
            return f"blocked by {name}, which is not in region {target.region}"
        case (
            protocol.Elsewhere(pose=pose) | protocol.Blocked(pose=pose) | protocol.Failed(pose=pose)
        ):
            near = {here.region, target.region}
            near |= {r for region in near for r in world.neighbours(region)}
            if pose.region not in near:
                return f"region {pose.region} is not next to the regions of its step"
            if (pose.heading is None) != (robot.model.mobility is Mobility.FREE):
                return f"it is a robot of {robot.model.mobility} mobility"
            return None
    return f"{type(event).__name__} ends no step"


def wrong_result(event: protocol.WorldEvent) -> str | None:
    """Return the reason why a well-formed event does not report results of an action; None if it
    does."""
    if isinstance(event, protocol.Acted):
        return None
    if isinstance(event, protocol.Failed):
        return event.reason
    return f"{type(event).__name__} ends no action"
