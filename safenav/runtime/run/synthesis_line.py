"""The trace line of a synthesis: its result, and all that its specification was made from."""

from __future__ import annotations

from collections.abc import Collection

from safenav.bounds import Place
from safenav.runtime.control.tasks import Controller
from safenav.scenario.objective import Ltl
from safenav.spec.assignable import neutral
from safenav.spec.assignable_regions import AssignableRegions, assignable_regions
from safenav.spec.compile import assumption_names
from safenav.spec.other_robots.belief import models
from safenav.spec.task import Task
from safenav.trace import records
from safenav.trace.vocabulary import Reason
from safenav.world.map import RegionMap
from safenav.world.moves import Pose


def synthesis_line(
    tick: int, reason: Reason, found: Controller, world: RegionMap
) -> records.Synthesis:
    """The line of a synthesis."""
    task, result = found.task, found.result
    hashes = result.spec_sha256, result.strategy_sha256
    possible = assignable_regions(task, world) if task.assignable else None
    return records.Synthesis(
        tick,
        task.robot.name,
        reason,
        result.verdict,
        round(result.seconds, 6),
        result.states,
        result.cached,
        result.verified,
        *hashes,
        found.asked,
        tuple(assumption_names(task, world)),
        node=found.node,
        region=task.pose.region,
        heading=task.pose.facing,
        memory=_memory(task),
        inputs={each.name: on for each, on in task.inputs} or None,
        again={each.name: each.again for each, _ in task.inputs if each.again} or None,
        closed=tuple((known.region, known.item) for known in task.blocked),
        knowledge={
            other.name: other.region if other.belief is None else tuple(sorted(other.belief))
            for other in task.observed
        },
        beliefs={
            model.other.name: tuple(tuple(sorted(belief)) for belief in model.beliefs)
            for model in models(task, world)
        }
        or None,
        sight_closed=tuple(sorted(task.closed)) if task.observed else None,
        places=None if possible is None else tuple(sorted(possible.places)),
        neutral=None if possible is None else neutral(possible),
        places_from=None if possible is None else _places_from(possible),
        forbidden=_ordered(task.forbidden) or None,
        form=found.form,
        allows=found.allows(world.word),
        tried=found.tried or None,
    )


def _places_from(possible: AssignableRegions) -> tuple[records.PlacesFrom, ...] | None:
    found = (
        records.PlacesFrom(tuple(sorted(part.regions)), _ordered(poses), dict(memory) or None)
        for part in possible.parts
        for memory, poses in part.poses().items()
    )
    return tuple(found) or None


def _ordered(poses: Collection[Pose]) -> tuple[Place, ...]:
    ordered = sorted(poses, key=lambda pose: (pose.region, pose.heading or 0))
    return tuple(pose.place for pose in ordered)


def _memory(task: Task) -> dict[str, int] | None:
    """The memory variables, and their values at the start."""
    objective = task.objective
    if isinstance(objective, Ltl):
        return dict(task.memory.values)
    if not objective.remembers(task.assignable):
        return None
    return {objective.turn: objective.begin(task.pose.region, task.memory.index)}
