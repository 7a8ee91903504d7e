"""Other robots as occupied neighbouring regions: four inputs, whatever the number of robots.

The input ``busy_north`` is true when the neighbouring region in the north is occupied at the moment
of the decision. That suffices to avoid collisions, it is sound whatever the others do (also those
that take several ticks for a step and occupy two regions meanwhile), and the game stays small: it
does not grow with the team, and with the map only as the robot's own motion does. It has no
foresight: the robot cannot plan around future positions of others. For automata that run without a
coordination layer (``safenav synth --avoiding``).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from safenav.spec.movement import headings, one_of, step_formula
from safenav.spec.specification import Constraint, Origin, Owner, Section, Variable
from safenav.spec.task import Task
from safenav.world.map import Heading, RegionMap

SOURCE = "safenav: other robots nearby"
MOVE = "move"


def busy(heading: Heading) -> str:
    """Return the input that is true if the region on that side is occupied."""
    return f"busy_{heading.label}"


def inputs(world: RegionMap) -> tuple[Variable, ...]:
    return tuple(
        Variable(busy(h), Owner.INPUT, None, f"another robot is in the region to the {h.label}")
        for h in headings(world)
    )


def outputs() -> tuple[Variable]:
    """Return the first output, by which the synthesizer chooses to stay among equally good moves: a
    robot that must wait does not wander."""
    note = "what it does: 0 stay, 1 north, 2 east, 3 south, 4 west"
    return (Variable(MOVE, Owner.OUTPUT, (0, 4), note),)


def guarantees(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Never enter a busy region; define ``move``."""
    begin = Origin(f"{task.item}.mobility", "what move says")
    yield Constraint(Section.SYS_INIT, f"{MOVE} = 0", begin)
    yield Constraint(Section.SYS_TRANS, f"{MOVE}' = 0 <-> region' = region", begin)
    for heading in headings(world):
        step = step_formula("region", heading, world)
        yield Constraint(Section.SYS_TRANS, f"{MOVE}' = {heading + 1} <-> {step}", begin)
    names = ", ".join(task.avoids)
    safe = Origin(task.item, f"never enter a region where another robot is ({names})", SOURCE)
    for heading in headings(world):
        yield Constraint(Section.SYS_TRANS, f"{busy(heading)}' -> {MOVE}' != {heading + 1}", safe)


def assumptions(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """The number of others is bounded, none is in a wall, and none is in the way forever."""
    begin = Origin(task.item, "nothing is observed before the first move", SOURCE)
    for heading in headings(world):
        yield Constraint(Section.ENV_INIT, f"!{busy(heading)}", begin)
    inside = Origin("map", "no robot is in a wall or off the map", SOURCE)
    for heading in headings(world):
        if dead_ends := world.dead_ends[heading]:
            formula = f"{one_of('region', dead_ends)} -> !{busy(heading)}'"
            yield Constraint(Section.ENV_TRANS, formula, inside)
    count = len(task.avoids)
    few = Origin("robots", f"{count} other robot{'s' * (count > 1)} cannot be everywhere", SOURCE)
    for sides in combinations(headings(world), count + 1):
        together = " & ".join(f"{busy(h)}'" for h in sides)
        yield Constraint(Section.ENV_TRANS, f"!({together})", few)
    if headings(world):
        # One condition for all sides costs one fixpoint, not four.
        rule = f"infinitely often no robot is beside it ({', '.join(task.avoids)})"
        nobody = " & ".join(f"!{busy(heading)}'" for heading in headings(world))
        yield Constraint(Section.ENV_LIVENESS, nobody, Origin(task.item, rule, SOURCE))
