"""Other robots as the environment of one: those that it tracks, by their exact positions or by
beliefs, and those that it avoids as occupied neighbouring regions (docs/tracking.md)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct

from safenav.scenario.model import Tracking
from safenav.spec.movement import one_of, stepping, walls
from safenav.spec.other_robots import belief, nearby
from safenav.spec.other_robots.knowledge import Knowledge
from safenav.spec.specification import Constraint, Origin, Owner, Section, Variable
from safenav.spec.task import Task
from safenav.world.map import RegionMap

SOURCE = "safenav: exact positions of other robots"


class OthersEncoding(Struct, frozen=True):
    """The others' share of a specification."""

    inputs: tuple[Variable, ...] = ()
    outputs: tuple[Variable, ...] = ()
    assumptions: tuple[Constraint, ...] = ()
    guarantees: tuple[Constraint, ...] = ()


def encode_others(task: Task, world: RegionMap) -> OthersEncoding:
    """Encode the robots that a task tracks or avoids; nothing if there are none."""
    inputs: tuple[Variable, ...] = ()
    assumptions: tuple[Constraint, ...] = ()
    if task.observed and task.tracking is Tracking.EXACT:
        inputs, assumptions = _positions(task, world), tuple(_moves(task, world))
    elif task.observed and task.tracking is Tracking.BELIEF:
        inputs, assumptions = belief.inputs(task, world), tuple(belief.assumptions(task, world))
    if not task.avoids:
        return OthersEncoding(inputs, (), assumptions)
    return OthersEncoding(
        (*inputs, *nearby.inputs(world)),
        (nearby.move_variable(),),
        (*assumptions, *nearby.assumptions(task, world)),
        tuple(nearby.guarantees(task, world)),
    )


def observe(task: Task, world: RegionMap, known: Mapping[str, Knowledge]) -> dict[str, int]:
    """Return the inputs of a task's strategy for this knowledge of the robots that it tracks (by
    name)."""
    if task.tracking is Tracking.BELIEF:
        return belief.observe(task, world, known) if task.observed else {}
    exact = task.observed if task.tracking is Tracking.EXACT else ()
    places = {other.variable: known[other.name] for other in exact}
    return {name: place for name, place in places.items() if not isinstance(place, frozenset)}


def _positions(task: Task, world: RegionMap) -> tuple[Variable, ...]:
    bounds = (0, world.size - 1)
    return tuple(
        Variable(other.variable, Owner.INPUT, bounds, f"where {other.name} is")
        for other in task.observed
    )


def _moves(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Others move by single steps; in a live run they go anywhere within reach."""
    for other in task.observed:
        item, name = f"robots.{other.name}", other.variable
        where = Origin(f"{item}.start", f"where {other.name} begins")
        yield Constraint(Section.ENV_INIT, f"{name} = {other.region}", where)
        if task.live:
            reach = world.distances([other.region])
            beyond = one_of(name, (r for r in world.free if r not in reach), "'")
            rule = Origin(f"{item}.mobility", "be where it can go", SOURCE)
            yield Constraint(Section.ENV_TRANS, f"!{beyond}", rule)
        else:
            yield from stepping(name, Section.ENV_TRANS, world, f"{item}.mobility")
        yield from walls(name, Section.ENV_TRANS, world, "map")
