"""The kinds of interventions: a user's possible changes between two ticks, as data."""

from __future__ import annotations

from typing import Any

from msgspec import Struct

from safenav.errors import UsageError
from safenav.runtime.worlds.reports import fitted
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


def well_formed(wanted: Any) -> Intervention:
    """Return an intervention all parts of which have their types: ``SetService("digit", "out")``
    would mean the opposite, since every text is true. Raises UsageError."""
    if not isinstance(wanted, Intervention) or type(wanted) is Intervention:
        raise UsageError(
            f"{wanted!r} is not an intervention: use safenav.MarkResolved or another class of "
            "interventions, or safenav.read_intervention(LINE, scenario)"
        )
    try:
        found: Intervention = fitted(wanted, type(wanted))
    except ValueError as error:
        raise UsageError(f"{type(wanted).__name__} {error}") from error
    return found
