"""The trace line of a synthesis."""

from __future__ import annotations

from safenav.runtime.coordination.strategy_search import TaskResult
from safenav.runtime.team import TeamState
from safenav.scenario.model import Tracking
from safenav.scenario.objective import Ltl
from safenav.spec.assignable import neutral
from safenav.spec.assignable_regions import AssignableRegions, assignable_regions
from safenav.spec.compile import assumption_names
from safenav.spec.other_robots.belief import models
from safenav.spec.task import Fairness, Task
from safenav.synthesis.verdict import SynthesisResult
from safenav.trace import records, vocabulary
from safenav.trace.header import heading_in_trace, objective_in_trace
from safenav.trace.vocabulary import Place
from safenav.world.moves import Pose


def synthesis_record(
    team: TeamState, found: TaskResult, reason: vocabulary.Reason, node: int | None = None
) -> records.Synthesis:
    """The line of a trace about a synthesis: its result, and all that its specification was made
    from; ``node``: where its strategy begins."""
    task, result = found.task, found.result
    world = team.scenario.map
    possible = assignable_regions(task, world) if task.assignable else None
    believed = task.tracking is Tracking.BELIEF and bool(task.observed)
    return records.Synthesis(
        team.tick,
        task.robot.name,
        reason,
        result.verdict,
        round(result.seconds, 6),
        result.states,
        result.cached,
        _verified(result),
        result.spec_sha256,
        result.strategy_sha256,
        objective_in_trace(found.told),
        tuple(assumption_names(task, world)),
        node=node,
        region=task.pose.region,
        heading=heading_in_trace(task.pose),
        memory=_memory(task),
        inputs={each.name: on for each, on in task.inputs} or None,
        again={each.name: each.again for each, _ in task.inputs if each.again} or None,
        closed=tuple((known.region, known.item) for known in task.blocked),
        moving=tuple(other.name for other in task.observed if other.danger),
        tracked=tuple(other.name for other in task.observed if not other.danger),
        tracking=task.tracking.value,
        fairness=task.fairness.value,
        others_targets={
            other.name: tuple(tuple(sorted(target)) for target in other.targets)
            for other in task.observed
            if task.fairness is Fairness.AT_ITS_TARGETS
        },
        knowledge={
            other.name: other.region if other.belief is None else tuple(sorted(other.belief))
            for other in task.observed
        },
        beliefs={
            model.other.name: tuple(tuple(sorted(b)) for b in model.beliefs)
            for model in models(task, world)
        }
        if believed
        else None,
        sight_closed=tuple(sorted(task.closed)) if believed else None,
        places=tuple(sorted(possible.places)) if possible is not None else None,
        neutral=neutral(possible) if possible is not None else None,
        places_from=_places_from(possible) if possible is not None else None,
        forbidden=_places(task.forbidden) or None,
        goal_places=tuple(map(_places, task.goal_places)) or None,
        form=found.form,
        allows=found.allows(world.word),
        tried=found.tried or None,
    )


def _places_from(possible: AssignableRegions) -> tuple[records.PlacesFrom, ...] | None:
    found = (
        records.PlacesFrom(tuple(sorted(part.regions)), _places(poses), dict(memory) or None)
        for part in possible.parts
        for memory, poses in part.poses().items()
    )
    return tuple(found) or None


def _verified(result: SynthesisResult) -> bool | vocabulary.Verified | None:
    return result.verified if result.served is None else vocabulary.Verified.MOVES


def _memory(task: Task) -> dict[str, int] | None:
    """The variables that remember, and their values at the start."""
    objective = task.objective
    if isinstance(objective, Ltl):
        return dict(task.memory.values)
    if not objective.remembers:
        return None
    return {objective.turn: objective.begin(task.pose.region, task.memory.index)}


def _places(poses: frozenset[Pose]) -> tuple[Place, ...]:
    """Return poses in the form of a trace."""
    ordered = sorted(poses, key=lambda pose: (pose.region, pose.heading or 0))
    return tuple((pose.region, heading_in_trace(pose)) for pose in ordered)
