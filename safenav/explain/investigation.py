"""Whole explanation of one robot: cause, core, witness, repairs.

Graph search comes first; the game decides the rest."""

from __future__ import annotations

import time
from collections.abc import Iterator

from msgspec.structs import replace

from safenav.errors import SafenavError
from safenav.explain.core import find_core
from safenav.explain.diagnosis import diagnose, held_ways
from safenav.explain.explanation import (
    Core,
    Explanation,
    NoStrategyCause,
    Repair,
    RepairKind,
    RepairProblem,
    Witness,
    WitnessEnd,
)
from safenav.explain.play import confinement, play_out
from safenav.explain.realizability import Questions
from safenav.explain.repair import Judge, find_repairs
from safenav.outcome import Verdict
from safenav.scenario.model import Scenario, Tracking
from safenav.scenario.objective import Ltl
from safenav.spec.compile import compile_task
from safenav.spec.movement import headings, one_of
from safenav.spec.other_robots.nearby import busy
from safenav.spec.specification import Constraint, Origin, Section, Specification
from safenav.spec.task import Task
from safenav.synthesis.slugs import Synthesizer
from safenav.world.map import Region, RegionMap

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
    if cause in (NoStrategyCause.CORNERED, NoStrategyCause.KEPT_AWAY):
        repairs += tuple(helpful_assumptions(spec, task, world, ask))
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


def helpful_assumptions(
    spec: Specification, task: Task, world: RegionMap, ask: Questions
) -> Iterator[Repair]:
    """Yield the weakest of the tried assumptions on the other robots that makes it realizable."""
    if not task.endangered:
        return
    origin = Origin(task.item, "an assumption about the other robots")
    for words, formulas in _demands(task, world):
        demands = (Constraint(Section.ENV_TRANS, formula, origin) for formula in formulas)
        if ask.verdict(spec.with_more(*demands)) is Verdict.REALIZABLE:
            yield Repair(RepairKind.ASSUMPTION, ((f"robots.{task.robot.name}", words),))
            return


def _demands(task: Task, world: RegionMap) -> Iterator[tuple[str, Iterator[str]]]:
    """Yield assumptions in words and as formulas, from the weakest to the strongest."""
    names = " and ".join(other.name for other in task.observed if other.danger)
    me = task.robot.name
    regions = frozenset().union(*task.targets)
    if regions:
        words = f"keep {names} away from {me} while it is at one of its targets"
        yield words, _keeps_clear(task, world, regions)
        if task.tracking is not Tracking.NEARBY:
            words = f"keep {names} away from the targets of {me}"
            around = regions | {n for r in regions for n in world.neighbours(r)}
            yield words, _stays_out(task, around)
    yield f"keep {names} away from {me}", _keeps_clear(task, world, None)


def _keeps_clear(task: Task, world: RegionMap, regions: frozenset[Region] | None) -> Iterator[str]:
    """Require that no robot comes next to the robot (while it is in one of the regions)."""
    places = world.free if regions is None else sorted(regions)
    if task.tracking is Tracking.NEARBY:
        clear = " & ".join(f"!{busy(heading)}'" for heading in headings(world))
        yield clear if regions is None else f"{one_of('region', places)} -> {clear}"
        return
    for other in task.observed:
        if other.danger:
            for region in places:
                beside = one_of(other.variable, world.neighbours(region), "'")
                yield f"region = {region} -> !({beside})"


def _stays_out(task: Task, regions: frozenset[Region]) -> Iterator[str]:
    for other in task.observed:
        if other.danger:
            yield f"!({one_of(other.variable, regions, chr(39))})"
