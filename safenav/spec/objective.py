"""Objectives as GR(1): memory variables, safety and recurrence goals of one robot.

``patrol`` is the paper's formula (Section VI, the definition of Patrol_p) with its bit
``scout``, plus the frame condition that the paper leaves unsaid. The others follow the same
habit: a goal is a state, and memory changes in the step after it. Goals are written about the
next state, so that the step that meets one is the last of its pursuit and the step after it
already pursues the next goal: about the current state, every goal would cost an idle step.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field

from safenav.dataclass import dataclass
from safenav.scenario.objective import Cover, Hold, Ltl, Objective, Patrol, Visit, describe
from safenav.scenario.pursuit import Pursuit
from safenav.spec.movement import one_of
from safenav.spec.specification import Constraint, Origin, Owner, Section, Variable
from safenav.world.map import Region

SOURCE_PATROL = "paper, Section VI, Patrol"
SOURCE_OBJECTIVE = "design, objectives"


@dataclass(frozen=True)
class Memory:
    """A robot's progress in its objective when it is resynthesized.

    ``index``: the target whose turn it is (patrol, visit). ``values``: the memory variables
    of an ``ltl`` objective, empty at the start of a run.
    """

    index: int = 0
    values: Mapping[str, int] = field(default_factory=dict)


NO_MEMORY = Memory()


@dataclass(frozen=True)
class ObjectiveEncoding:
    """An objective's share of a specification."""

    variables: tuple[Variable, ...]
    constraints: tuple[Constraint, ...]


def encode(objective: Objective, item: str, region: Region, memory: Memory) -> ObjectiveEncoding:
    """Encode an objective for a robot that stands in ``region`` and remembers ``memory``.

    ``item`` is the scenario item that the constraints' origins name.
    """
    variables: tuple[Variable, ...]
    match objective:
        case Patrol():
            variables = (Variable("scout", Owner.OUTPUT, None, "true: the second target is next"),)
            return ObjectiveEncoding(variables, tuple(_patrol(objective, item, region, memory)))
        case Visit(targets):
            if len(targets) == 1:
                return ObjectiveEncoding((), tuple(_recur(objective, item)))
            bounds = (0, len(targets) - 1)
            variables = (Variable("goal", Owner.OUTPUT, bounds, "the target whose turn it is"),)
            return ObjectiveEncoding(variables, tuple(_visit(objective, item, memory)))
        case Cover():
            return ObjectiveEncoding((), tuple(_recur(objective, item)))
        case Hold():
            return ObjectiveEncoding((), tuple(_hold(objective, item)))
        case Ltl():
            variables = tuple(
                Variable(name, Owner.OUTPUT, bounds, "memory of the objective")
                for name, bounds in objective.memory.items()
            )
            return ObjectiveEncoding(variables, tuple(_ltl(objective, item, memory)))


def _patrol(patrol: Patrol, item: str, region: Region, memory: Memory) -> Iterator[Constraint]:
    first, second = one_of("region", patrol.first), one_of("region", patrol.second)
    first_next = one_of("region", patrol.first, "'")
    second_next = one_of("region", patrol.second, "'")
    about_first, about_second = tuple(sorted(patrol.first)), tuple(sorted(patrol.second))
    scout = Pursuit(patrol).begin(region, memory.index) == 1
    what = describe(patrol)

    def origin(rule: str) -> Origin:
        return Origin(item, f"{what}: {rule}", SOURCE_PATROL)

    yield Constraint(
        Section.SYS_INIT, "scout" if scout else "!scout", origin("which target comes first")
    )
    turn = origin("at a target, turn to the other one and leave")
    yield Constraint(
        Section.SYS_TRANS,
        f"{first} & !scout -> scout' & !({first_next})",
        turn,
        about_first,
    )
    yield Constraint(
        Section.SYS_TRANS,
        f"{second} & scout -> !scout' & !({second_next})",
        turn,
        about_second,
    )
    frame = f"!({first} & !scout) & !({second} & scout) -> (scout' <-> scout)"
    yield Constraint(Section.SYS_TRANS, frame, origin("it turns round at a target only"))
    apart = origin("never at the target whose turn it is not")
    yield Constraint(Section.SYS_TRANS, f"!({first_next} & scout')", apart, about_first)
    yield Constraint(Section.SYS_TRANS, f"!({second_next} & !scout')", apart, about_second)
    recur = origin("infinitely often at each target in its turn")
    yield Constraint(Section.SYS_LIVENESS, f"{first_next} & !scout'", recur, about_first)
    yield Constraint(Section.SYS_LIVENESS, f"{second_next} & scout'", recur, about_second)


def _visit(visit: Visit, item: str, memory: Memory) -> Iterator[Constraint]:
    count = len(visit.targets)
    what = describe(visit)
    begin = Origin(item, f"{what}: which target comes first", SOURCE_OBJECTIVE)
    yield Constraint(Section.SYS_INIT, f"goal = {memory.index}", begin)
    turn = Origin(item, f"{what}: at the target whose turn it is, on to the next", SOURCE_OBJECTIVE)
    recur = Origin(item, f"{what}: infinitely often at each target in turn", SOURCE_OBJECTIVE)
    for index, target in enumerate(visit.targets):
        there = one_of("region", target)
        about = tuple(sorted(target))
        following = (index + 1) % count
        yield Constraint(
            Section.SYS_TRANS, f"goal = {index} & {there} -> goal' = {following}", turn, about
        )
        yield Constraint(
            Section.SYS_TRANS, f"goal = {index} & !({there}) -> goal' = {index}", turn, about
        )
    for index, target in enumerate(visit.targets):
        there_next = one_of("region", target, "'")
        formula = f"goal' = {index} & {there_next}"
        yield Constraint(Section.SYS_LIVENESS, formula, recur, tuple(sorted(target)))


def _recur(objective: Visit | Cover, item: str) -> Iterator[Constraint]:
    """Each target infinitely often, in any order: GR(1) needs no memory for that."""
    rule = f"{describe(objective)}: infinitely often at each target"
    origin = Origin(item, rule, SOURCE_OBJECTIVE)
    for target in objective.targets:
        yield Constraint(
            Section.SYS_LIVENESS, one_of("region", target, "'"), origin, tuple(sorted(target))
        )


def _hold(hold: Hold, item: str) -> Iterator[Constraint]:
    what = describe(hold)
    stay = Origin(item, f"{what}: once there, stay", "paper, Section VI, Patrol(s, s)")
    for region in sorted(hold.target):
        yield Constraint(
            Section.SYS_TRANS, f"region = {region} -> region' = {region}", stay, (region,)
        )
    come = Origin(item, f"{what}: infinitely often there", "paper, Section VI, Patrol(s, s)")
    yield Constraint(
        Section.SYS_LIVENESS, one_of("region", hold.target, "'"), come, tuple(sorted(hold.target))
    )


def _ltl(ltl: Ltl, item: str, memory: Memory) -> Iterator[Constraint]:
    begin = Origin(item, "ltl: how the memory begins", SOURCE_OBJECTIVE)
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
