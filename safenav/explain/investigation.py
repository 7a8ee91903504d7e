"""Whole explanation of one robot: cause, core, witness, repairs.

Graph search comes first; the game decides the rest."""

from __future__ import annotations

import time

from msgspec.structs import replace

from safenav.errors import SafenavError
from safenav.explain.core import find_core
from safenav.explain.diagnosis import diagnose, held_ways
from safenav.explain.explanation import (
    Core,
    Explanation,
    NoStrategyCause,
    RepairProblem,
    Witness,
    WitnessEnd,
)
from safenav.explain.play import confinement, play_out
from safenav.explain.realizability import Questions
from safenav.explain.repair import Judge, find_repairs
from safenav.scenario.model import Scenario
from safenav.scenario.objective import Ltl
from safenav.spec.compile import compile_task
from safenav.spec.specification import Section, Specification
from safenav.spec.task import Task
from safenav.synthesis.slugs import Synthesizer
from safenav.world.map import RegionMap

REPAIR_SECONDS = 2.0


def explain(scenario: Scenario, task: Task, synthesizer: Synthesizer, judge: Judge) -> Explanation:
    """Explain why an unrealizable ``task`` of a scenario's robot has no strategy.

    ``judge`` returns whether that robot has a strategy at the start of a changed scenario. The
    synthesizer's limits hold for each single query."""
    begun = time.monotonic()
    world = scenario.map
    spec = compile_task(task, world)
    ask = Questions(synthesizer)
    found = diagnose(task, world)
    core = find_core(spec, task, world, found, ask)
    witness = confinement(found) or _played_out(spec, task, world, synthesizer)
    cause = found.cause or _cause(core, witness, task)
    if cause in (NoStrategyCause.CORNERED, NoStrategyCause.KEPT_AWAY):
        holding = held_ways(task, world, scenario)
        if holding:
            cause, found = (
                NoStrategyCause.PARKED_ROBOT,
                replace(found, cause=NoStrategyCause.PARKED_ROBOT, culprits=holding),
            )
    deadline = time.monotonic() + REPAIR_SECONDS
    problem = RepairProblem(scenario, task, cause, found, deadline)
    repairs = find_repairs(problem, judge)
    seconds = time.monotonic() - begun
    return Explanation(task.robot.name, task, cause, found, core, witness, repairs, seconds)


def _played_out(
    spec: Specification, task: Task, world: RegionMap, synthesizer: Synthesizer
) -> Witness | None:
    """Return a witness from the environment's strategy; None if the limits do not allow it."""
    try:
        strategy = synthesizer.counterstrategy(spec).strategy
        return None if strategy is None else play_out(spec, strategy, task, world)
    except SafenavError:
        return None


def _cause(core: Core, witness: Witness | None, task: Task) -> NoStrategyCause:
    """Return the cause if the map and the mobility alone are not the reason."""
    if not core.alone:
        stuck = witness is not None and witness.ending in (
            WitnessEnd.STUCK,
            WitnessEnd.NO_BEGINNING,
        )
        return NoStrategyCause.CORNERED if stuck else NoStrategyCause.KEPT_AWAY
    known = {k.item for k in task.blocked}
    items = [member.origin.item for member in core.members]
    if any(item in known and item.startswith("robots.") for item in items):
        return NoStrategyCause.PARKED_ROBOT
    if any(item in known for item in items):
        return NoStrategyCause.OBSTACLE
    if all(c.section is Section.SYS_INIT for m in core.members for c in m.constraints):
        return NoStrategyCause.IMPOSSIBLE_START
    own = (f"{task.item}.objective", f"{task.item}.start")
    if isinstance(task.objective, Ltl) and all(item in own for item in items):
        return NoStrategyCause.CONTRADICTION
    return NoStrategyCause.FORBIDDEN_WAY
