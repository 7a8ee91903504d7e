"""The losing play of a robot on its map, and why no move is left at its end. If graph search
suffices, the regions within reach are the witness."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import islice, product

from msgspec.structs import replace

from safenav.explain.explanation import (
    Core,
    Diagnosis,
    Dilemma,
    LosingPlay,
    NoStrategyCause,
    PlayEnd,
    Values,
)
from safenav.explain.play import MOST_INPUTS, losing_play
from safenav.explain.realizability import Questions
from safenav.scenario.guarantees import values_of
from safenav.spec.specification import Constraint, Owner, Section, Specification, Variable
from safenav.spec.task import Task
from safenav.verify.automaton import clauses
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.moves import Pose, moves


def confinement(found: Diagnosis, core: Core, task: Task) -> LosingPlay | None:
    """Return the play that needs no game: the robot visits all regions that it can reach, without
    the target. None unless the core is about the robot's moves."""
    lost = found.lost or found.cause is NoStrategyCause.CROSSING
    moving = f"{task.item}.mobility" in {member.origin.item for member in core.members}
    if found.cause is None or not lost or not moving:
        return None
    return LosingPlay(PlayEnd.CONFINED)


def play_out(
    whole: Specification, core: Specification, task: Task, world: RegionMap, ask: Questions
) -> LosingPlay | None:
    """Return a play of the robot that the core loses; None if the limits do not allow it."""
    play = losing_play(whole, core, ask, partial(_nearness, core, world))
    if play is None or play.ending is not PlayEnd.STUCK:
        return play
    return replace(play, dilemmas=tuple(_dilemmas(core, play, task, world)))


def _nearness(core: Specification, world: RegionMap, goal: Constraint) -> Callable[[Values], int]:
    """Return the distance to the regions of a goal, without regard to headings."""
    field = world.distances(goal.regions or _regions_of(goal, core, world))
    return lambda values: field.get(values["region"], world.size)


def _regions_of(goal: Constraint, core: Specification, world: RegionMap) -> list[Region]:
    """Return the regions in which a formula can hold."""
    (clause,) = clauses(replace(core, constraints=(goal,)), Section.SYS_LIVENESS)
    mentioned = {name for name, _ in clause.places} - {"region"}
    choices = [*_valuations([v for v in core.variables if v.name in mentioned])]
    known = ((region, {**values, "region": region}) for region in world.free for values in choices)
    return [region for region, values in known if clause.holds(values, values)]


def _dilemmas(
    core: Specification, play: LosingPlay, task: Task, world: RegionMap
) -> Iterator[Dilemma]:
    """Yield for each move of its mobility the guarantee that it would break."""
    now, inputs = play.walk[-1], dict(play.pressure)
    heading = Heading(now["heading"]) if "heading" in now else None
    promised = clauses(core, Section.SYS_TRANS)
    for after in moves(task.robot.model.mobility, Pose(now["region"], heading), world):
        later = {**inputs, **values_of(after)}
        free = [v for v in core.owned(Owner.OUTPUT) if v.name not in later]
        choices = ({**later, **values} for values in _valuations(free))
        broken = ([c.constraint for c in promised if not c.holds(now, then)] for then in choices)
        fewest = min(broken, key=len)
        if fewest:
            yield Dilemma(after.region, after.heading, fewest[0])


def _valuations(variables: Sequence[Variable]) -> Iterator[Values]:
    """Yield values of all these variables, up to a limit."""
    names = [variable.name for variable in variables]
    first = (variable.range[:MOST_INPUTS] for variable in variables)
    for choice in islice(product(*first), MOST_INPUTS):
        yield dict(zip(names, choice, strict=True))
