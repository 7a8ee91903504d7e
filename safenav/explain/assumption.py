"""Assumptions that would make a task realizable, as guarantees of the other robots.

A scenario cannot state them, but its author can choose the others' objectives so that they hold."""

from __future__ import annotations

from collections.abc import Iterator

from safenav.explain.explanation import Repair, RepairKind
from safenav.explain.realizability import Questions
from safenav.outcome import Verdict
from safenav.scenario.model import Tracking
from safenav.spec.movement import headings, one_of
from safenav.spec.other_robots.nearby import busy
from safenav.spec.specification import Constraint, Origin, Section, Specification
from safenav.spec.task import Task
from safenav.world.map import Region, RegionMap


def helpful_assumptions(
    spec: Specification, task: Task, world: RegionMap, ask: Questions
) -> Iterator[Repair]:
    """Yield the weakest of the tried assumptions on the other robots that makes it realizable."""
    if not task.endangered:
        return
    for words, constraints in _promises(task, world):
        variant = Specification(
            spec.robot, spec.title, spec.variables, (*spec.constraints, *constraints)
        )
        if ask.verdict(variant) is Verdict.REALIZABLE:
            yield Repair(RepairKind.ASSUMPTION, ((f"robots.{task.robot.name}", words),))
            return


def _promises(task: Task, world: RegionMap) -> Iterator[tuple[str, list[Constraint]]]:
    """Yield assumptions in words and as constraints, from the weakest to the strongest."""
    names = " and ".join(other.name for other in task.observed if other.danger)
    me = task.robot.name
    regions = frozenset().union(*task.targets)
    if regions:
        words = f"{names} never next to {me} while it is at one of its targets"
        yield words, list(_keeps_clear(task, world, regions))
        if task.tracking is not Tracking.NEARBY:
            words = f"{names} never in a target of {me}, nor next to one"
            around = regions | {n for r in regions for n in world.neighbours(r)}
            yield words, list(_stays_out(task, around))
    yield f"{names} never next to {me}", list(_keeps_clear(task, world, None))


def _keeps_clear(
    task: Task, world: RegionMap, regions: frozenset[Region] | None
) -> Iterator[Constraint]:
    """Require that no robot comes next to the robot (while it is in one of the regions)."""
    origin = Origin(task.item, "an assumption about the other robots")
    places = world.free if regions is None else sorted(regions)
    if task.tracking is Tracking.NEARBY:
        clear = " & ".join(f"!{busy(heading)}'" for heading in headings(world))
        formula = clear if regions is None else f"{one_of('region', places)} -> {clear}"
        yield Constraint(Section.ENV_TRANS, formula, origin)
        return
    for other in task.observed:
        if other.danger:
            for region in places:
                beside = one_of(other.variable, world.neighbours(region), "'")
                formula = f"region = {region} -> !({beside})"
                yield Constraint(Section.ENV_TRANS, formula, origin)


def _stays_out(task: Task, regions: frozenset[Region]) -> Iterator[Constraint]:
    origin = Origin(task.item, "an assumption about the other robots")
    for other in task.observed:
        if other.danger:
            formula = f"!({one_of(other.variable, regions, chr(39))})"
            yield Constraint(Section.ENV_TRANS, formula, origin)
