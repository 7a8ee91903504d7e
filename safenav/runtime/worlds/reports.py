"""Checks of a world's reports before they are used: whether they are well formed, and whether they
can be true. Any world may report anything."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import pairwise
from math import isfinite
from numbers import Real
from typing import Any

import msgspec

from safenav.runtime.worlds import protocol
from safenav.scenario.model import Obstacle, Robot
from safenav.trace.vocabulary import ActResult
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.moves import Mobility, Pose


def is_time(found: Any) -> bool:
    """Whether a value can be a time in seconds."""
    try:
        return isinstance(found, (float, Real)) and isfinite(found)
    except OverflowError:  # an int beyond every float
        return False


def is_region(found: Any) -> bool:
    """Whether a value can be the number of a region; traces cannot contain numpy's integers."""
    return type(found) is int


def misfit(obstacle: Obstacle) -> str | None:
    """Return the reason why an obstacle cannot be part of a scenario; None if it can. Python checks
    neither types nor bounds: it accepts ``Obstacle("door", 47)``."""
    where = f"the obstacle in region {obstacle.region}"
    try:
        same = msgspec.convert(msgspec.to_builtins(obstacle), Obstacle) == obstacle
    except (msgspec.ValidationError, TypeError) as error:
        return f"{where} has a wrong part: {error}"
    if not same:
        return f"{where} has a list in place of a frozenset or a tuple"
    listed = obstacle.type.listed
    if listed and listed[0].same:
        return f"{where} has no previous need for 'same'"
    if any(need.same and need.robots != last.robots for last, need in pairwise(listed)):
        return f"{where} needs other numbers of robots for a 'same' need"
    return None


def malformed(event: Any, robots: Collection[str]) -> str | None:
    """Return the reason why a report is malformed (parts of wrong types, unknown names); None if it
    is well formed."""
    if not isinstance(event, protocol.WorldEvent):
        return f"{event!r} is not an event"
    if not is_time(event.at):
        return f"its time is {event.at!r}, not seconds"
    for part in event.__struct_fields__:
        kinds, found = _PARTS.get(part, (object,)), getattr(event, part)
        left_out = found is None and part in _LEFT_OUT
        if found is None and part == "command" and not isinstance(event, protocol.Sensed):
            return "it names no command (command=, the number that start or act was given)"
        if not left_out and not isinstance(found, kinds):
            expected = " or ".join(kind.__name__ for kind in kinds)
            return f"its {part} is {found!r}, not {expected}"
    for name in (getattr(event, "robot", None), getattr(event, "by", None)):
        if name is not None and name not in robots:
            return f"no robot is named {name!r}"
    if isinstance(event, protocol.Sensed) and event.obstacle is None:
        return "it names no obstacle"
    pose = getattr(event, "pose", None)
    if pose is not None and not isinstance(pose.heading, Heading | None):
        return f"its heading is {pose.heading!r}"
    obstacle = getattr(event, "obstacle", None)
    for region in (*claimed(event), *(() if obstacle is None else (obstacle.region,))):
        if not is_region(region):
            return f"region {region!r} is not an int"
    return None if obstacle is None else misfit(obstacle)


_PARTS: dict[str, tuple[type, ...]] = {
    "command": (int,),
    "robot": (str,),
    "by": (str,),
    "reason": (str,),
    "pose": (Pose,),
    "regions": (frozenset, set),
    "obstacle": (Obstacle,),
}
"""The allowed types of parts of events."""
_LEFT_OUT = {"by", "command", "reason", "obstacle"}
"""Parts that may be None."""


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
    """Return the reason why a well-formed event does not report valid results of an action; None if
    it does."""
    match event:
        case protocol.Acted(found=found) if isinstance(found, Sequence) and all(
            isinstance(pair, tuple | list)
            and len(pair) == 2
            and isinstance(pair[0], Obstacle)
            and is_region(pair[0].region)
            and isinstance(pair[1], ActResult)
            for pair in found
        ):
            return next((why for pair in found if (why := misfit(pair[0])) is not None), None)
        case protocol.Acted():
            return f"its results are {event.found!r}"
        case protocol.Failed():
            return event.reason
    return f"{type(event).__name__} ends no action"
