"""Compile one robot's share of a mission to a GR(1) specification (docs/specifications.md).

Only variables that some guarantee can depend on are modelled: the robot's own pose and memory as
outputs, its knowledge of other robots as inputs.
"""

from __future__ import annotations

from collections.abc import Iterator

from safenav.scenario.objective import describe
from safenav.spec import assignable, belief, nearby
from safenav.spec.movement import heading_rules, stepping, walls
from safenav.spec.objective import encode
from safenav.spec.specification import Constraint, Origin, Owner, Section, Specification, Variable
from safenav.spec.task import Task
from safenav.world.map import RegionMap
from safenav.world.poses import Mobility


def compile_task(task: Task, world: RegionMap) -> Specification:
    """Return the specification of one robot for its current task.

    Source: paper, Sections III and VI; docs/specifications.md.
    """
    robot = task.robot
    avoiding = bool(task.avoids)
    objective = encode(
        task.objective, f"{task.item}.objective", task.pose.region, task.memory, task.assignable
    )
    steered = task.assignable
    own = [
        assignable.excused(each, task.objective.settles) if steered else each
        for each in objective.constraints
    ]
    variables = [
        *(assignable.inputs(world) if steered else ()),
        *belief.inputs(task, world),
        *(nearby.inputs(world) if avoiding else ()),
        *(Variable(each.name, Owner.INPUT, None, "an input") for each, _ in task.inputs),
        *(nearby.outputs() if avoiding else ()),
        Variable("region", Owner.OUTPUT, (0, world.size - 1), f"where {robot.name} is"),
    ]
    if robot.model.mobility is Mobility.HEADING:
        note = f"which way {robot.name} faces: 0 north, 1 east, 2 south, 3 west"
        variables.append(Variable("heading", Owner.OUTPUT, (0, 3), note))
    variables += objective.variables
    constraints = [
        *(assignable.assumptions(task, world) if steered else ()),
        *_assumptions(task, world),
        *_beginning(task),
        *_motion(task, world),
        *(assignable.guarantees(task, world) if steered else ()),
        *own,
    ]
    title = f"{robot.name} ({robot.model.name}): {describe(task.objective)}"
    return Specification(robot.name, title, tuple(variables), tuple(constraints))


def assumption_names(task: Task, world: RegionMap) -> list[str]:
    """Return the fairness assumptions that a task relies on, in words."""
    rules = (
        constraint.origin.rule
        for constraint in _assumptions(task, world)
        if constraint.section is Section.ENV_LIVENESS
    )
    return list(dict.fromkeys(rules))


def _assumptions(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the assumptions about the robots that it tracks or avoids, and about inputs."""
    yield from belief.assumptions(task, world)
    if task.avoids:
        yield from nearby.assumptions(task, world)
    yield from _environment(task)


def _environment(task: Task) -> Iterator[Constraint]:
    """Yield the present values of the inputs, and those assumed to recur infinitely often."""
    for each, on in task.inputs:
        origin = Origin(f"inputs.{each.name}", "as it is now")
        yield Constraint(Section.ENV_INIT, each.name if on else f"!{each.name}", origin)
        for value in each.again:
            rule = f"infinitely often {each.name} is {'on' if value else 'off'}"
            formula = f"{each.name}'" if value else f"!{each.name}'"
            yield Constraint(Section.ENV_LIVENESS, formula, Origin(f"inputs.{each.name}", rule))


def _beginning(task: Task) -> Iterator[Constraint]:
    origin = Origin(f"{task.item}.start", "where it begins")
    pose = task.pose
    yield Constraint(Section.SYS_INIT, f"region = {pose.region}", origin, (pose.region,))
    if task.robot.model.mobility is Mobility.HEADING and pose.heading is not None:
        yield Constraint(Section.SYS_INIT, f"heading = {pose.heading:d}", origin)


def _motion(task: Task, world: RegionMap) -> Iterator[Constraint]:
    mobility = task.robot.model.mobility
    yield from stepping("region", Section.SYS_TRANS, world, f"{task.item}.mobility")
    if mobility is Mobility.HEADING:
        yield from heading_rules(world, f"{task.item}.mobility")
    yield from walls("region", Section.SYS_TRANS, world, "map")
    for known in task.blocked:
        origin = Origin(known.item, known.reason, "paper, eq. (3)")
        formula = f"region' != {known.region}"
        if known.region == task.pose.region:
            formula = f"region = {known.region} | {formula}"  # it may stay where it is
        yield Constraint(Section.SYS_TRANS, formula, origin, (known.region,))
    lost = Origin("coordination", "from there the team could not continue", "design, section 5")
    for pose in sorted(task.forbidden, key=lambda pose: (pose.region, pose.heading or 0)):
        formula = f"region' != {pose.region}"
        if pose.heading is not None:
            formula += f" | heading' != {pose.heading:d}"
        yield Constraint(Section.SYS_TRANS, formula, lost, (pose.region,))
    if task.avoids:
        yield from nearby.guarantees(task, world)
