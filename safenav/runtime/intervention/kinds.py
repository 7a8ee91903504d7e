"""The kinds of interventions: a user's possible changes between two ticks, as data."""

from __future__ import annotations

from typing import Any, get_type_hints

from msgspec import Struct

from safenav.scenario.model import ObstacleType
from safenav.scenario.objective import Objective
from safenav.world.map import Region
from safenav.world.moves import Pose


class Intervention(Struct, frozen=True):
    """A change by a user."""


class AddObstacle(Intervention, frozen=True):
    """An obstacle that appears in a region, as soon as no robot is there. ``truth``: revealed by
    resolving it, for a type that has a truth."""

    type: ObstacleType
    region: Region
    truth: bool | None = None


class PlaceOrder(Intervention, frozen=True):
    """An order: an obstacle of a type that blocks no robot, requested by no robot."""

    type: ObstacleType
    region: Region


class RemoveObstacle(Intervention, frozen=True):
    """An obstacle that disappears, by its name."""

    obstacle: str


class SetTruth(Intervention, frozen=True):
    """Another truth that resolving an obstacle reveals."""

    obstacle: str
    traversable: bool


class AssignObjective(Intervention, frozen=True):
    """A robot gets another objective of its own."""

    robot: str
    objective: Objective


class SetService(Intervention, frozen=True):
    """A robot is out of service, or back in it."""

    robot: str
    active: bool


class SetInput(Intervention, frozen=True):
    """An input of the environment is on, or off, from now on."""

    name: str
    on: bool


class MarkResolved(Intervention, frozen=True):
    """An operator has resolved an obstacle, by its name."""

    obstacle: str


class MarkPermanent(Intervention, frozen=True):
    """An obstacle that the team has encountered is permanent, by its name."""

    obstacle: str


class PutBack(Intervention, frozen=True):
    """A robot that has no command stands in ``pose`` now, and is in service."""

    robot: str
    pose: Pose


class GiveUp(Intervention, frozen=True):
    """The run ends: with the conclusion for which it waits, else as interrupted."""


def misfit(wanted: object) -> str | None:
    """The reason why a value is not an intervention, or has parts of wrong types; None if it is
    one. ``SetService("digit", "out")`` would mean the opposite, since every text is true."""
    if not isinstance(wanted, Intervention) or type(wanted) is Intervention:
        return (
            f"{wanted!r} is not an intervention: use safenav.MarkResolved or another class of "
            "interventions, or safenav.read_intervention(LINE, scenario)"
        )
    parts: list[Any] = [wanted]
    if isinstance(wanted, PutBack) and isinstance(wanted.pose, Pose):
        parts.append(wanted.pose)
    for part in parts:
        for name, kind in get_type_hints(type(part)).items():
            value = getattr(part, name)
            if not isinstance(value, kind) or (kind is int and isinstance(value, bool)):
                expected = getattr(kind, "__name__", str(kind).replace("safenav.", ""))
                return f"'{name}' of {type(part).__name__} is {value!r}, not {expected}"
    return None
