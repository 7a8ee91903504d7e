"""A task as a trace tells it: the circumstances that its specification was made from, as data.

A reader needs them to say what a strategy's inputs mean and whether they are those of the run.
The names are those of a ``synthesis`` line (docs/trace.md).
"""

from collections.abc import Iterable
from typing import Any

from safenav.scenario.model import Tracking
from safenav.scenario.objective import Ltl, Patrol, Visit
from safenav.spec.assignable_regions import assignable_regions
from safenav.spec.other_robots.belief import models
from safenav.spec.task import Fairness, Task
from safenav.world.map import RegionMap
from safenav.world.moves import Pose


def circumstances(task: Task, world: RegionMap) -> dict[str, Any]:
    """The fields of a ``synthesis`` line that tell what ``task`` is about.

    Regions are ids, headings words, beliefs lists of cells in the order of their values.
    """
    heading = task.pose.heading
    positions = [] if task.tracking is Tracking.NEARBY else list(task.observed)
    told: dict[str, Any] = {
        "region": task.pose.region,
        "heading": None if heading is None else heading.label,
        "memory": _memory(task),
        "closed": [[k.region, k.item.removeprefix("obstacles.")] for k in task.blocked],
        "moving": [other.name for other in task.observed if other.danger],
        "tracked": [other.name for other in positions if not other.danger],
        "tracking": task.tracking.value,
        "fairness": task.fairness.value,
        "knowledge": {
            other.name: other.region if other.belief is None else sorted(other.belief)
            for other in positions
        },
    }
    if task.fairness is Fairness.AT_ITS_TARGETS:
        told["others_targets"] = {
            other.name: [sorted(target) for target in other.targets]
            for other in task.observed
            if other.danger
        }
    if task.tracking is Tracking.BELIEF:
        told["beliefs"] = {
            model.other.name: [sorted(belief) for belief in model.beliefs]
            for model in models(task, world)
        }
        told["sight_closed"] = sorted(task.closed)
    if task.assignable:
        possible = assignable_regions(task, world)
        told["places"] = sorted(possible.places)
        told["neutral"] = min(told["places"])
        told["places_from"] = [
            {"places": sorted(part.regions), "from": _told(poses), "memory": dict(memory)}
            for part in possible.parts
            for memory, poses in part.poses().items()
        ]
    return told


def _told(poses: Iterable[Pose]) -> list[list[Any]]:
    return [[p.region, None if p.heading is None else p.heading.label] for p in poses]


def _memory(task: Task) -> dict[str, int]:
    """The variables that remember how far the objective is, and their values at the start."""
    match task.objective:
        case Patrol():
            first = task.objective.begin(task.pose.region, task.memory.index)
            return {"scout": first}
        case Visit(targets) if len(targets) > 1:
            return {"goal": task.memory.index}
        case Ltl():
            return dict(task.memory.values)
    return {}
