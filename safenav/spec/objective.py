"""Objectives as GR(1): memory variables, safety and recurrence goals of one robot.

``patrol`` of two targets is the paper's formula (Section VI, the definition of Patrol_p) with its
bit ``scout``, plus the frame condition that the paper omits. The others follow the same pattern: a
goal is a state, and memory changes in the step after it. Goals are written about the next state, so
that the step that meets one is the last of its pursuit and the step after it already pursues the
next goal: on the current state, every goal would cost an idle step.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from msgspec import Struct, field

from safenav.scenario.objective import Ltl, Objective, Patrol, TargetObjective, describe, on_steps
from safenav.spec.movement import one_of
from safenav.spec.specification import Constraint, Origin, Owner, Section, Variable
from safenav.world.map import Region

SOURCE_PATROL = "paper, Section VI, Patrol"
SOURCE_HOLD = "paper, Section VI, Patrol(s, s)"
SOURCE_OBJECTIVE = "design, objectives"


class Memory(Struct, frozen=True):
    """A robot's progress in its objective when it is resynthesized.

    ``index``: the target whose turn it is (patrol, visit). ``values``: the memory variables
    of an ``ltl`` objective, empty at the start of a run.
    """

    index: int = 0
    values: Mapping[str, int] = field(default_factory=dict)


NO_MEMORY = Memory()


class ObjectiveEncoding(Struct, frozen=True):
    """An objective's share of a specification."""

    variables: tuple[Variable, ...]
    constraints: tuple[Constraint, ...]


def encode(
    objective: Objective, item: str, region: Region, memory: Memory, assigned: bool = False
) -> ObjectiveEncoding:
    """Encode an objective for a robot that stands in ``region`` and remembers ``memory``.

    ``item`` is the scenario item that the constraints' origins name; ``assigned``: goals can be
    assigned to the robot at runtime.
    """
    if isinstance(objective, Ltl):
        variables = tuple(
            Variable(name, Owner.OUTPUT, bounds, "memory of the objective")
            for name, bounds in objective.memory.items()
        )
        return ObjectiveEncoding(variables, tuple(_ltl(objective, item, memory)))
    goal = objective.turn if objective.remembers(assigned) else ""
    variables, constraints = _about_targets(objective, item, region, memory, goal)
    rule = Origin(f"{item}.always", "on each step that it takes", SOURCE_OBJECTIVE)
    steps = (Constraint(Section.SYS_TRANS, on_steps(text), rule) for text in objective.always)
    return ObjectiveEncoding(variables, (*constraints, *steps))


def _about_targets(
    objective: TargetObjective, item: str, region: Region, memory: Memory, goal: str
) -> tuple[tuple[Variable, ...], Iterator[Constraint]]:
    if _is_the_papers(objective):
        scout = Variable("scout", Owner.OUTPUT, None, "true: the second target is next")
        return (scout,), _patrol(objective, item, region, memory)
    bounds = (0, len(objective.targets) - 1)
    next_ = Variable(goal, Owner.OUTPUT, bounds, "the target whose turn it is")
    return (next_,) if goal else (), _pursuit(objective, item, region, memory, goal)


def _is_the_papers(objective: TargetObjective) -> bool:
    """Return whether it is a patrol between two targets, the paper's formula."""
    return isinstance(objective, Patrol) and len(objective.targets) == 2


def _patrol(
    patrol: TargetObjective, item: str, region: Region, memory: Memory
) -> Iterator[Constraint]:
    what, places = describe(patrol), [one_of("region", target) for target in patrol.targets]
    scout = "scout" if patrol.begin(region, memory.index) == 1 else "!scout"

    def origin(rule: str) -> Origin:
        return Origin(item, f"{what}: {rule}", SOURCE_PATROL)

    yield Constraint(Section.SYS_INIT, scout, origin("which target comes first"))
    turn = origin("at a target, turn to the other one and leave")
    apart = origin("never at the target whose turn it is not")
    recur = origin("infinitely often at each target in its turn")
    away, goals = [], []
    for target, here, own, other in zip(
        patrol.targets, places, ("!scout", "scout"), ("scout'", "!scout'"), strict=True
    ):
        there, about = one_of("region", target, "'"), tuple(sorted(target))
        leave = f"{here} & {own} -> {other} & !({there})"
        yield Constraint(Section.SYS_TRANS, leave, turn, about)
        away.append(Constraint(Section.SYS_TRANS, f"!({there} & {other})", apart, about))
        goals.append(Constraint(Section.SYS_LIVENESS, f"{there} & {own}'", recur, about))
    frame = f"!({places[0]} & !scout) & !({places[1]} & scout) -> (scout' <-> scout)"
    yield Constraint(Section.SYS_TRANS, frame, origin("it turns round at a target only"))
    yield from (*away, *goals)


def _pursuit(
    objective: TargetObjective, item: str, region: Region, memory: Memory, goal: str
) -> Iterator[Constraint]:
    """Yield the order of the targets, if the variable ``goal`` remembers it, and each target
    infinitely often. Without it the next one is the first: a strategy takes its goals in their
    order, and infinitely often at each is infinitely often at each in turn."""
    targets, what, last = objective.targets, describe(objective), len(objective.targets) - 1
    settles = objective.settles
    source = SOURCE_HOLD if settles and not goal else SOURCE_OBJECTIVE

    def origin(rule: str) -> Origin:
        return Origin(item, f"{what}: {rule}", source)

    if goal:
        begin = f"{goal} = {objective.begin(region, memory.index)}"
        yield Constraint(Section.SYS_INIT, begin, origin("which target comes first"))
        turn = origin("at the target whose turn it is, on to the next")
        for index, target in enumerate(targets):
            there, about = one_of("region", target), tuple(sorted(target))
            now, following = f"{goal} = {index}", objective.turned(index, next(iter(target)))
            leave = f"{now} & {there} -> {goal}' = {following}"
            yield Constraint(Section.SYS_TRANS, leave, turn, about)
            stay = f"{now} & !({there}) -> {goal}' = {index}"
            yield Constraint(Section.SYS_TRANS, stay, turn, about)
    for index, target in enumerate(targets if objective.strict else ()):
        apart = f"{one_of('region', target, chr(39))} -> {goal}' = {index}"
        rule = origin("never at a target out of its turn")
        yield Constraint(Section.SYS_TRANS, apart, rule, tuple(sorted(target)))
    for place in sorted(targets[last]) if settles else ():
        now = f"{goal} = {last} & region = {place}" if goal else f"region = {place}"
        rule = origin("at the last one, stay" if goal else "once there, stay")
        yield Constraint(Section.SYS_TRANS, f"{now} -> region' = {place}", rule, (place,))
    ordered = objective.in_turn and not goal
    recur = "at each target in turn" if goal else "at each target"
    recur += ", beginning with the next" if ordered and last else ""
    if settles:
        recur = "at the last one" if goal else "there"
    first = objective.turned(objective.begin(region, memory.index), region) if ordered else 0
    for index in (*range(first, len(targets)), *range(first)):
        target = targets[index]
        if index == last or not settles:
            there = one_of("region", target, "'")
            formula = f"{goal}' = {index} & {there}" if goal else there
            rule = origin(f"infinitely often {recur}")
            yield Constraint(Section.SYS_LIVENESS, formula, rule, tuple(sorted(target)))


def _ltl(ltl: Ltl, item: str, memory: Memory) -> Iterator[Constraint]:
    begin = Origin(item, "ltl: at the start", SOURCE_OBJECTIVE)
    if memory.values:
        for name, bounds in ltl.memory.items():
            value = memory.values[name]
            formula = f"{name} = {value}" if bounds else (name if value else f"!{name}")
            yield Constraint(Section.SYS_INIT, formula, begin)
    else:
        for formula in ltl.init:
            yield Constraint(Section.SYS_INIT, formula, begin)
    always = Origin(item, "ltl: always", SOURCE_OBJECTIVE)
    for formula in ltl.safety:
        yield Constraint(Section.SYS_TRANS, formula, always)
    recur = Origin(item, "ltl: infinitely often", SOURCE_OBJECTIVE)
    for formula in ltl.liveness:
        yield Constraint(Section.SYS_LIVENESS, formula, recur)
