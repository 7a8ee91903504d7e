"""Whole explanation of one robot (cause, core, witness, repairs), or of a specification by lines.

Graph search comes first; the game decides the rest."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import islice, product

from msgspec import Struct
from msgspec.structs import replace

from safenav.explain.core import find_core, find_line_core
from safenav.explain.diagnosis import diagnose
from safenav.explain.explanation import (
    Core,
    Diagnosis,
    Dilemma,
    Explanation,
    LosingPlay,
    NoStrategyCause,
    PlayEnd,
    RepairProblem,
    Values,
    with_guarantees,
)
from safenav.explain.play import MOST_INPUTS, losing_play
from safenav.explain.realizability import Questions
from safenav.explain.repair import Judge, find_repairs
from safenav.outcome import Verdict
from safenav.scenario.guarantees import values_of
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Ltl
from safenav.spec.compile import compile_task
from safenav.spec.specification import (
    Constraint,
    Origin,
    Owner,
    Section,
    Specification,
    Variable,
)
from safenav.spec.task import Task
from safenav.synthesis.slugs import Synthesizer
from safenav.verify.automaton import clauses
from safenav.world.map import Heading, Region, RegionMap
from safenav.world.moves import Pose, moves

REPAIR_SECONDS = 2.0
_C = NoStrategyCause


def explain(scenario: Scenario, task: Task, synthesizer: Synthesizer, judge: Judge) -> Explanation:
    """Explain why an unrealizable ``task`` of a scenario's robot has no strategy.

    ``judge`` returns whether that robot has a strategy at the start of a changed scenario."""
    begun = time.monotonic()
    world = scenario.map
    spec = compile_task(task, world)
    ask = Questions(synthesizer)
    found = diagnose(task, world)
    core = find_core(spec, task, world, found, ask)
    ask.spend(1.0)
    part = with_guarantees(spec, core.constraints)
    play = confinement(found, core, task) or play_out(spec, part, task, world, ask)
    cause = found.cause or _cause(core, task)
    closed = {member.origin.item for member in core.members}
    if cause is not found.cause and cause is _C.OBSTACLE:
        found = replace(found, culprits=tuple(k for k in task.blocked if k.item in closed))
    deadline = time.monotonic() + REPAIR_SECONDS
    problem = RepairProblem(scenario, task, cause, found, deadline)
    repairs = find_repairs(problem, judge)
    seconds = time.monotonic() - begun
    return Explanation(task.robot.name, task, cause, found, core, play, repairs, seconds)


def _cause(core: Core, task: Task) -> NoStrategyCause:
    """Return the cause if graph search has found none."""
    sections = {constraint.section for constraint in core.constraints}
    if sections == {Section.SYS_INIT}:
        return _C.IMPOSSIBLE_START
    if core.together is None:
        return _C.CONFLICT
    if core.together:
        return _C.KEPT_AWAY if Section.SYS_LIVENESS in sections else _C.CORNERED
    known = {k.item for k in task.blocked}
    items = [member.origin.item for member in core.members]
    if any(item in known for item in items):
        return _C.OBSTACLE
    own = (f"{task.item}.objective", f"{task.item}.start")
    if isinstance(task.objective, Ltl) and all(item in own for item in items):
        return _C.CONTRADICTION
    return _C.FORBIDDEN_WAY


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


MOST_ASSUMPTIONS = 32
PLAY_SHARE = 0.85
"""Share of the budget by which the play ends."""


class LineExplanation(Struct, frozen=True):
    """Explanation of an unrealizable specification.

    ``fairness``: the lines of ENV_LIVENESS, which it may assume. ``play``: of the core; None where
    the limits did not allow it. ``assumptions``: lines of ENV_LIVENESS, each of which makes it
    realizable."""

    core: Core
    fairness: tuple[Constraint, ...]
    play: LosingPlay | None
    assumptions: tuple[str, ...]


def explain_lines(spec: Specification, synthesizer: Synthesizer) -> LineExplanation:
    """Explain why a specification is unrealizable, as far as the budget allows."""
    ask = Questions(synthesizer)
    core = find_line_core(spec, ask)
    ask.spend(PLAY_SHARE)
    play = losing_play(spec, with_guarantees(spec, core.constraints), ask)
    ask.spend(1.0)
    assumptions = () if core.alone else tuple(_helpful(spec, ask))
    fairness = spec.section(Section.ENV_LIVENESS)
    return LineExplanation(core, fairness, play, assumptions)


def _helpful(spec: Specification, ask: Questions) -> Iterator[str]:
    """Yield assumptions that one Boolean input is on, or off, infinitely often, where this makes
    the specification realizable and does not let the system win by breaking it."""
    inputs = [v.name for v in spec.owned(Owner.INPUT) if v.bounds is None]
    lines = [line for name in inputs for line in (f"{name}'", f"!{name}'")][:MOST_ASSUMPTIONS]
    fair = {line: Constraint(Section.ENV_LIVENESS, line, _TRIED) for line in lines}
    tried = {line: spec.with_more(constraint) for line, constraint in fair.items()}
    ask.prepare(list(tried.values()))
    never = Constraint(Section.SYS_LIVENESS, "FALSE", _TRIED)
    for line, stronger in tried.items():
        if ask.verdict(stronger) is Verdict.REALIZABLE:
            hopeless = stronger.without(spec.section(Section.SYS_LIVENESS)).with_more(never)
            if ask.verdict(hopeless) is Verdict.UNREALIZABLE:
                yield line


_TRIED = Origin("explanation", "tried")
