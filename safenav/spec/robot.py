"""Compile one robot's share of a mission to a GR(1) specification (DESIGN section 4).

Only what some guarantee can depend on is modelled: the robot's own pose and memory as
outputs, the positions of the robots that it could collide with as inputs, nothing else.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import IntEnum

from safenav.scenario.model import Robot
from safenav.scenario.objective import Objective, Target, describe
from safenav.spec.motion import heading_rules, one_of, stepping, walls
from safenav.spec.objective import NO_MEMORY, Memory, encode
from safenav.spec.specification import (
    Constraint,
    Origin,
    Owner,
    Section,
    Specification,
    Variable,
)
from safenav.world.map import Region, RegionMap
from safenav.world.mobility import Mobility, Pose

SOURCE_COLLISION = "design, section 4"


class Fairness(IntEnum):
    """What a robot assumes of those that share its layer, from weakest to strongest."""

    NONE = 0
    OFF_MY_TARGETS = 1
    AT_ITS_TARGETS = 2


@dataclass(frozen=True)
class Known:
    """A region that is known not to be enterable now, and the scenario item that says why."""

    region: Region
    item: str
    reason: str


@dataclass(frozen=True)
class Observed:
    """Another robot of the same layer: where it is, and the targets of its objective."""

    name: str
    region: Region
    targets: tuple[Target, ...] = ()

    @property
    def variable(self) -> str:
        return f"at_{self.name}"


@dataclass(frozen=True)
class Task:
    """Everything that one robot's specification depends on.

    ``blocked``: obstacles known by now (O beyond the walls) that block this robot.
    ``observed``: the moving robots that it must not collide with.
    """

    robot: Robot
    pose: Pose
    objective: Objective
    memory: Memory = NO_MEMORY
    blocked: tuple[Known, ...] = ()
    observed: tuple[Observed, ...] = ()
    fairness: Fairness = Fairness.NONE
    targets: tuple[Target, ...] = field(default=())


def compile_task(task: Task, world: RegionMap) -> Specification:
    """The specification of one robot for its current task.

    Source: paper, Sections III and VI; DESIGN section 4.
    """
    robot = task.robot
    item = f"robots.{robot.name}"
    encoding = encode(task.objective, f"{item}.objective", task.pose.region, task.memory)
    variables = [
        *(_position_of(other, world) for other in task.observed),
        Variable("region", Owner.OUTPUT, (0, world.size - 1), f"where {robot.name} is"),
    ]
    if robot.model.mobility is Mobility.HEADING:
        note = f"which way {robot.name} faces: 0 north, 1 east, 2 south, 3 west"
        variables.append(Variable("heading", Owner.OUTPUT, (0, 3), note))
    variables += encoding.variables
    constraints = [
        *_assumptions(task, world),
        *_beginning(task, item),
        *_motion(task, world, item),
        *encoding.constraints,
    ]
    title = f"{robot.name} ({robot.model.name}): {describe(task.objective)}"
    return Specification(robot.name, title, tuple(variables), tuple(constraints))


def assumption_names(task: Task) -> list[str]:
    """The fairness assumptions that a task relies on, in words."""
    return [str(c.origin.rule) for c in _fairness(task)]


def _position_of(other: Observed, world: RegionMap) -> Variable:
    return Variable(
        other.variable, Owner.INPUT, (0, world.size - 1), f"where {other.name} is, same layer"
    )


def _beginning(task: Task, item: str) -> Iterator[Constraint]:
    origin = Origin(f"{item}.start", "where it begins")
    pose = task.pose
    yield Constraint(Section.SYS_INIT, f"region = {pose.region}", origin, (pose.region,))
    if task.robot.model.mobility is Mobility.HEADING and pose.heading is not None:
        yield Constraint(Section.SYS_INIT, f"heading = {pose.heading:d}", origin)


def _motion(task: Task, world: RegionMap, item: str) -> Iterator[Constraint]:
    mobility = task.robot.model.mobility
    yield from stepping("region", Section.SYS_TRANS, world, f"{item}.mobility")
    if mobility is Mobility.HEADING:
        yield from heading_rules(world, f"{item}.mobility")
    yield from walls("region", Section.SYS_TRANS, world, "map")
    for known in task.blocked:
        origin = Origin(known.item, known.reason, "paper, eq. (3)")
        yield Constraint(Section.SYS_TRANS, f"region' != {known.region}", origin, (known.region,))
    for other in task.observed:
        origin = Origin(
            f"robots.{other.name}",
            f"never enter the region where {other.name} is",
            SOURCE_COLLISION,
        )
        yield Constraint(Section.SYS_TRANS, f"region' != {other.variable}'", origin)


def _assumptions(task: Task, world: RegionMap) -> Iterator[Constraint]:
    for other in task.observed:
        item = f"robots.{other.name}"
        name = other.variable
        where = Origin(f"{item}.start", f"where {other.name} begins")
        yield Constraint(Section.ENV_INIT, f"{name} = {other.region}", where)
        yield from stepping(name, Section.ENV_TRANS, world, f"{item}.mobility")
        yield from walls(name, Section.ENV_TRANS, world, "map")
        polite = Origin(item, f"{other.name} does not step onto this robot", SOURCE_COLLISION)
        yield Constraint(Section.ENV_TRANS, f"{name}' != region", polite)
    yield from _fairness(task)


def _fairness(task: Task) -> Iterator[Constraint]:
    if task.fairness is Fairness.NONE:
        return
    for other in task.observed:
        item = f"robots.{other.name}"
        if task.fairness is Fairness.OFF_MY_TARGETS:
            for target in task.targets:
                words = "|".join(str(r) for r in sorted(target))
                rule = f"{other.name} is infinitely often not at {words}"
                formula = f"!({one_of(other.variable, target)})"
                yield Constraint(
                    Section.ENV_LIVENESS, formula, Origin(item, rule, SOURCE_COLLISION)
                )
        else:
            for target in other.targets:
                words = "|".join(str(r) for r in sorted(target))
                rule = f"{other.name} is infinitely often at {words}"
                formula = one_of(other.variable, target)
                yield Constraint(
                    Section.ENV_LIVENESS, formula, Origin(item, rule, SOURCE_COLLISION)
                )
