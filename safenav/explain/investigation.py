"""Whole explanation of one robot: cause, core, witness, repairs.

Graph search comes first; the game decides the rest."""

from __future__ import annotations

import time

from msgspec.structs import replace

from safenav.explain.core import find_core
from safenav.explain.diagnosis import diagnose
from safenav.explain.explanation import (
    Core,
    Explanation,
    NoStrategyCause,
    RepairProblem,
    with_guarantees,
)
from safenav.explain.realizability import Questions
from safenav.explain.repair import Judge, find_repairs
from safenav.explain.witness import confinement, play_out
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Ltl
from safenav.spec.compile import compile_task
from safenav.spec.specification import Section
from safenav.spec.task import Task
from safenav.synthesis.slugs import Synthesizer

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
