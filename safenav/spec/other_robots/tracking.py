"""Other robots as the environment of one: their model, and its observations.

Three models with one interface (docs/tracking.md): occupied neighbouring regions (``nearby``),
exact positions (``exact``) and possible positions (``belief``).
"""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct, field

from safenav.scenario.model import Tracking
from safenav.spec.other_robots import belief, exact, nearby
from safenav.spec.other_robots.knowledge import Knowledge
from safenav.spec.specification import Constraint, Variable
from safenav.spec.task import Task
from safenav.world.map import Region, RegionMap


class Sightings(Struct, frozen=True):
    """The observable state around a robot: its region, the regions occupied by robots with which it
    must not collide, and the ``positions`` of the robots that it tracks, or its knowledge of them
    (``known``)."""

    region: Region
    taken: frozenset[Region]
    positions: Mapping[str, Region]
    known: Mapping[str, Knowledge] = field(default_factory=dict)


class OthersEncoding(Struct, frozen=True):
    """The others' share of a specification."""

    inputs: tuple[Variable, ...] = ()
    outputs: tuple[Variable, ...] = ()
    assumptions: tuple[Constraint, ...] = ()
    guarantees: tuple[Constraint, ...] = ()


def _watches(task: Task) -> bool:
    """Whether other robots are inputs of a task's strategy."""
    return task.endangered if task.tracking is Tracking.NEARBY else bool(task.observed)


def encode_others(task: Task, world: RegionMap) -> OthersEncoding:
    """Encode the robots that a task observes; nothing if there are none."""
    if not _watches(task):
        return OthersEncoding()
    if task.tracking is Tracking.NEARBY:
        return OthersEncoding(
            nearby.inputs(world),
            (nearby.move_variable(),),
            tuple(nearby.assumptions(task, world)),
            tuple(nearby.guarantees(task, world)),
        )
    model = exact if task.tracking is Tracking.EXACT else belief
    return OthersEncoding(
        model.inputs(task, world),
        (),
        tuple(model.assumptions(task, world)),
        tuple(model.guarantees(task)),
    )


def observe(task: Task, world: RegionMap, sightings: Sightings) -> dict[str, int]:
    """Return the inputs of a task's strategy for these sightings."""
    if not _watches(task):
        return {}
    match task.tracking:
        case Tracking.NEARBY:
            return nearby.observe(sightings.region, sightings.taken, world)
        case Tracking.EXACT:
            return exact.observe(task, sightings.positions)
        case Tracking.BELIEF:
            return belief.observe(task, world, sightings.known)
