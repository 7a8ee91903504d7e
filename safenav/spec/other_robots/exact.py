"""Exact positions of the other robots: one input ``at_NAME`` with the region of each.

The most precise model, and the most expensive: each robot multiplies the game by the map's size.
See docs/performance.md for figures.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from safenav.scenario.objective import Target, number_word
from safenav.spec.movement import headings, on_side, one_of, stepping, walls
from safenav.spec.specification import Constraint, Origin, Owner, Section, Variable
from safenav.spec.task import Fairness, Observed, Task
from safenav.world.map import Region, RegionMap

SOURCE = "safenav: exact positions of other robots"


def inputs(task: Task, world: RegionMap) -> tuple[Variable, ...]:
    bounds = (0, world.size - 1)
    return tuple(
        Variable(other.variable, Owner.INPUT, bounds, f"where {other.name} is")
        for other in task.observed
    )


def guarantees(task: Task, rule: str = "is", source: str = SOURCE) -> Iterator[Constraint]:
    """Never enter the region where another robot is, or ``is seen``."""
    for other in task.observed:
        if other.danger:
            never = f"never enter the region where {other.name} {rule}"
            origin = Origin(f"robots.{other.name}", never, source)
            yield Constraint(Section.SYS_TRANS, f"region' != {other.variable}'", origin)


def assumptions(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Others move by single steps and do not step onto this robot (they guarantee it). In a live
    run, where they are only robots that cannot collide with it, they go anywhere within reach."""
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
        if not other.danger:
            continue
        polite = Origin(item, f"{other.name} does not step onto this robot", SOURCE)
        yield Constraint(Section.ENV_TRANS, f"{name}' != region", polite)
    yield from fairness(task, world)


def _at(other: Observed, target: Target, _surely: bool) -> str:
    return one_of(other.variable, target)


def fairness(
    task: Task,
    world: RegionMap,
    at: Callable[[Observed, Target, bool], str] = _at,
    maybe: tuple[str, str] = ("", ""),
    source: str = SOURCE,
) -> Iterator[Constraint]:
    """Yield the fairness assumption of the task, if it has one. ``at``: the condition that another
    robot is at a target, surely or perhaps; ``maybe``: words for doubt, if it may not be or may be
    there."""
    if task.fairness is Fairness.OUT_OF_MY_WAY:
        yield from out_of_my_way(task, world)
        return
    for other in task.observed:
        if not other.danger:
            continue
        item = f"robots.{other.name}"
        if task.fairness is Fairness.OFF_MY_TARGETS:
            for target in task.targets:
                rule = f"{other.name} is infinitely often not at {number_word(target)}{maybe[0]}"
                formula = f"!({at(other, target, True)})"
                yield Constraint(Section.ENV_LIVENESS, formula, Origin(item, rule, source))
        elif task.fairness is Fairness.AT_ITS_TARGETS:
            for target in other.targets:
                rule = f"{other.name} is infinitely often at {number_word(target)}{maybe[1]}"
                formula = at(other, target, False)
                yield Constraint(Section.ENV_LIVENESS, formula, Origin(item, rule, source))


def out_of_my_way(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the assumption that infinitely often no robot is beside this one: one for all others
    together, since they could take turns."""
    dangers = [other for other in task.observed if other.danger]
    if not dangers or not headings(world):
        return
    rule = f"infinitely often no robot is beside it ({', '.join(o.name for o in dangers)})"
    sides = [on_side(o.variable, heading, world) for heading in headings(world) for o in dangers]
    formula = f"!({' | '.join(sides)})"
    yield Constraint(Section.ENV_LIVENESS, formula, Origin(task.item, rule, SOURCE))


def observe(task: Task, positions: Mapping[str, Region]) -> dict[str, int]:
    """Return the inputs when the others are at these positions (robot's name -> region)."""
    return {other.variable: positions[other.name] for other in task.observed}
