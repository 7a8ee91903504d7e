"""Compiler of one robot's share of a mission to a GR(1) specification (docs/specifications.md).

The specification models only variables on which some guarantee can depend: the robot's own pose and
memory as outputs, its knowledge of other robots as inputs.

Objectives: ``patrol`` of two targets is the paper's formula (Section VI, the definition of
Patrol_p) with its bit ``scout``, plus the frame condition that the paper omits. Other objectives
follow the same pattern: a goal is a state, and memory changes in the step after it. Goals are about
the next state: the step that meets a goal is the last of its pursuit, and the next step already
pursues the next goal. Goals about the current state would cost an idle step each.

Robots to avoid (``safenav synth --avoiding``, for automata that run without a coordination layer)
are occupied neighbouring regions: the input ``busy_north`` is true if the region in the north is
occupied at the moment of the decision. That suffices to avoid collisions with any behaviour of
other robots (also those that occupy two regions during a step of several ticks). The game stays
small: it does not grow with the team, and with the map only as the robot's own motion does. The
robot cannot plan around future positions of other robots.
"""

from collections.abc import Iterator
from itertools import combinations

from safenav.formula.syntax import one_of
from safenav.scenario.objective import Ltl, Patrol, describe, on_steps
from safenav.spec import assignable, belief
from safenav.spec.specification import (
    Constraint,
    Origin,
    Owner,
    Section,
    Specification,
    Variable,
    heading_rules,
    headings,
    step_formula,
    stepping,
    walls,
)
from safenav.spec.task import Task
from safenav.world.map import Heading, RegionMap
from safenav.world.poses import Mobility


def compile_task(task: Task, world: RegionMap) -> Specification:
    """Return the specification of a robot for its current task.

    Source: paper, Sections III and VI; docs/specifications.md.
    """
    robot = task.robot
    avoiding = bool(task.avoids)
    own, goals = encode(task, world)
    steered = task.assignable
    variables = [
        *(assignable.inputs(world) if steered else ()),
        *belief.inputs(task, world),
        *(_nearby_inputs(world) if avoiding else ()),
        *(Variable(each.name, Owner.INPUT, None, "an input") for each, _ in task.inputs),
        *(_move_output() if avoiding else ()),
        Variable("region", Owner.OUTPUT, (0, world.size - 1), f"region of {robot.name}"),
    ]
    if robot.model.mobility is Mobility.HEADING:
        note = f"heading of {robot.name}: 0 north, 1 east, 2 south, 3 west"
        variables.append(Variable("heading", Owner.OUTPUT, (0, 3), note))
    variables += own
    constraints = [
        *(assignable.assumptions(task, world) if steered else ()),
        *_assumptions(task, world),
        *_beginning(task),
        *_motion(task, world),
        *(assignable.guarantees(task, world) if steered else ()),
        *goals,
    ]
    title = f"{robot.name} ({robot.model.name}): {describe(task.objective)}"
    return Specification(robot.name, title, tuple(variables), tuple(constraints))


def assumption_names(task: Task, world: RegionMap) -> list[str]:
    """Return the fairness assumptions of a task in words."""
    rules = (
        constraint.origin.rule
        for constraint in _assumptions(task, world)
        if constraint.section is Section.ENV_LIVENESS
    )
    return list(dict.fromkeys(rules))


def _assumptions(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the assumptions about tracked or avoided robots and about inputs."""
    yield from belief.assumptions(task, world)
    if task.avoids:
        yield from _nearby_assumptions(task, world)
    yield from _environment(task)


def _environment(task: Task) -> Iterator[Constraint]:
    """Yield the present values of the inputs and assumptions about values that must recur."""
    for each, on in task.inputs:
        origin = Origin(f"inputs.{each.name}", "its present value")
        yield Constraint(Section.ENV_INIT, each.name if on else f"!{each.name}", origin)
        for value in each.again:
            rule = f"infinitely often {each.name} is {'on' if value else 'off'}"
            formula = f"{each.name}'" if value else f"!{each.name}'"
            yield Constraint(Section.ENV_LIVENESS, formula, Origin(f"inputs.{each.name}", rule))


def _beginning(task: Task) -> Iterator[Constraint]:
    origin = Origin(f"{task.item}.start", "initial pose")
    pose = task.pose
    yield Constraint(Section.SYS_INIT, f"region = {pose.region}", origin, (pose.region,))
    if task.robot.model.mobility is Mobility.HEADING and pose.heading is not None:
        yield Constraint(Section.SYS_INIT, f"heading = {pose.heading:d}", origin)


def _motion(task: Task, world: RegionMap) -> Iterator[Constraint]:
    mobility = task.robot.model.mobility
    yield from stepping(world, f"{task.item}.mobility")
    if mobility is Mobility.HEADING:
        yield from heading_rules(world, f"{task.item}.mobility")
    yield from walls(world)
    for known in task.blocked:
        origin = Origin(known.item, known.reason, "paper, eq. (3)")
        formula = f"region' != {known.region}"
        if known.region == task.pose.region:
            formula = f"region = {known.region} | {formula}"  # the robot may stay where it is
        yield Constraint(Section.SYS_TRANS, formula, origin, (known.region,))
    lost = Origin("coordination", "from there the team could not continue", "design, section 5")
    for pose in sorted(task.forbidden, key=lambda pose: (pose.region, pose.heading or 0)):
        formula = f"region' != {pose.region}"
        if pose.heading is not None:
            formula += f" | heading' != {pose.heading:d}"
        yield Constraint(Section.SYS_TRANS, formula, lost, (pose.region,))
    if task.avoids:
        yield from _nearby_guarantees(task, world)


SOURCE_PATROL = "paper, Section VI, Patrol"
SOURCE_HOLD = "paper, Section VI, Patrol(s, s)"
SOURCE_OBJECTIVE = "design, objectives"


def encode(task: Task, world: RegionMap) -> tuple[list[Variable], list[Constraint]]:
    """Return the variables and constraints of a task's objective. A region assigned to the robot at
    runtime excuses its goals."""
    objective, item = task.objective, f"{task.item}.objective"
    if isinstance(objective, Ltl):
        variables = [
            Variable(name, Owner.OUTPUT, bounds, "memory of the objective")
            for name, bounds in objective.memory.items()
        ]
        found = _ltl(objective, item, task)
    elif isinstance(objective, Patrol) and len(objective.targets) == 2:  # the paper's formula
        variables = [Variable("scout", Owner.OUTPUT, None, "true: the second target is next")]
        found = _patrol(task, item)
    else:
        goal = objective.turn if task.remembers else ""
        bounds = (0, len(objective.targets) - 1)
        following = Variable(goal, Owner.OUTPUT, bounds, "the target whose turn it is")
        variables, found = [following] if goal else [], _pursuit(task, world, item, goal)
    constraints = [
        assignable.excused(each, world)
        if task.assignable and each.section is Section.SYS_LIVENESS
        else each
        for each in found
    ]
    rule = Origin(f"{item}.always", "on each step that it takes", SOURCE_OBJECTIVE)
    for text in objective.always:
        constraints.append(Constraint(Section.SYS_TRANS, on_steps(text), rule))
    return variables, constraints


def _patrol(task: Task, item: str) -> Iterator[Constraint]:
    patrol = task.objective
    what, places = describe(patrol), [one_of("region", target) for target in patrol.targets]
    first = patrol.begin(task.pose.region, task.memory.index)
    scout = "scout" if first == 1 else "!scout"

    def origin(rule: str) -> Origin:
        return Origin(item, f"{what}: {rule}", SOURCE_PATROL)

    yield Constraint(Section.SYS_INIT, scout, origin("the first target"))
    turn = origin("at a target, turn to the other one and leave")
    apart = origin("never at a target out of its turn")
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
    yield Constraint(Section.SYS_TRANS, frame, origin("its next target changes only at a target"))
    yield from (*away, *goals)


def _pursuit(task: Task, world: RegionMap, item: str, goal: str) -> Iterator[Constraint]:
    """Yield the order of the targets, if the variable ``goal`` stores the next one, and each target
    infinitely often. Without ``goal``, the next target is listed first, since a strategy takes
    goals in their order. A robot that meets each infinitely often also meets each in turn."""
    objective, region = task.objective, task.pose.region
    targets, what, last = objective.targets, describe(objective), len(objective.targets) - 1
    settles, first = objective.settles, objective.begin(region, task.memory.index)
    source = SOURCE_HOLD if settles and not goal else SOURCE_OBJECTIVE

    def origin(rule: str) -> Origin:
        return Origin(item, f"{what}: {rule}", source)

    if goal:
        yield Constraint(Section.SYS_INIT, f"{goal} = {first}", origin("the first target"))
        turn = origin("from each target on to the next")
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
        rest = Constraint(Section.SYS_TRANS, f"{now} -> region' = {place}", rule, (place,))
        yield assignable.excused(rest, world) if task.assignable else rest
    recur = "at each target in turn" if goal else "at each target"
    recur += ", beginning with the next" if objective.in_turn and last and not goal else ""
    if settles:
        recur = "at the last one" if goal else "there"
    first = 0 if goal else first
    order = [*range(first, len(targets)), *range(first)] if objective.in_turn else task.tour(world)
    if not goal and region in targets[order[0]]:
        order.append(order.pop(0))  # a target where the robot begins is met
    for index in order:
        target = targets[index]
        if index == last or not settles:
            there = one_of("region", target, "'")
            formula = f"{goal}' = {index} & {there}" if goal else there
            rule = origin(f"infinitely often {recur}")
            yield Constraint(Section.SYS_LIVENESS, formula, rule, tuple(sorted(target)))


def _ltl(ltl: Ltl, item: str, task: Task) -> Iterator[Constraint]:
    begin, values = Origin(item, "ltl: at the start", SOURCE_OBJECTIVE), task.memory.values
    if values:
        for name, bounds in ltl.memory.items():
            value = values[name]
            formula = f"{name} = {value}" if bounds else (name if value else f"!{name}")
            yield Constraint(Section.SYS_INIT, formula, begin)
    elif ltl.memory or task.pose == task.robot.start:  # pose conditions hold only at the start
        for formula in ltl.init:
            yield Constraint(Section.SYS_INIT, formula, begin)
    always = Origin(item, "ltl: always", SOURCE_OBJECTIVE)
    for formula in ltl.safety:
        yield Constraint(Section.SYS_TRANS, formula, always)
    recur = Origin(item, "ltl: infinitely often", SOURCE_OBJECTIVE)
    for formula in ltl.liveness:
        yield Constraint(Section.SYS_LIVENESS, formula, recur)


SOURCE_NEARBY = "safenav: other robots nearby"
MOVE = "move"


def busy(heading: Heading) -> str:
    """Return the name of the input that is true if the region on a side is occupied."""
    return f"busy_{heading.label}"


def _nearby_inputs(world: RegionMap) -> tuple[Variable, ...]:
    return tuple(
        Variable(busy(h), Owner.INPUT, None, f"another robot is in the region to the {h.label}")
        for h in headings(world)
    )


def _move_output() -> tuple[Variable]:
    """Return the output ``move``, the first one. It makes the synthesizer prefer the stay among
    equally good moves, so a robot that must wait does not wander."""
    note = "its move: 0 stay, 1 north, 2 east, 3 south, 4 west"
    return (Variable(MOVE, Owner.OUTPUT, (0, 4), note),)


def _nearby_guarantees(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the guarantees: the robot never enters a busy region; ``move`` is defined."""
    begin = Origin(f"{task.item}.mobility", "the definition of move")
    yield Constraint(Section.SYS_INIT, f"{MOVE} = 0", begin)
    yield Constraint(Section.SYS_TRANS, f"{MOVE}' = 0 <-> region' = region", begin)
    for heading in headings(world):
        step = step_formula("region", heading, world)
        yield Constraint(Section.SYS_TRANS, f"{MOVE}' = {heading + 1} <-> {step}", begin)
    names = ", ".join(task.avoids)
    safe = Origin(
        task.item, f"never enter a region where another robot is ({names})", SOURCE_NEARBY
    )
    for heading in headings(world):
        yield Constraint(Section.SYS_TRANS, f"{busy(heading)}' -> {MOVE}' != {heading + 1}", safe)


def _nearby_assumptions(task: Task, world: RegionMap) -> Iterator[Constraint]:
    """Yield the assumptions: the number of other robots is bounded, none is in a wall, and none
    blocks the robot forever."""
    begin = Origin(task.item, "nothing is observed before the first move", SOURCE_NEARBY)
    for heading in headings(world):
        yield Constraint(Section.ENV_INIT, f"!{busy(heading)}", begin)
    inside = Origin("map", "no robot is in a wall or off the map", SOURCE_NEARBY)
    closed = {None, *world.walls}
    for heading in headings(world):
        if dead_ends := [r for r in world.free if world.step(r, heading) in closed]:
            formula = f"{one_of('region', dead_ends)} -> !{busy(heading)}'"
            yield Constraint(Section.ENV_TRANS, formula, inside)
    count = len(task.avoids)
    few = Origin("robots", f"other robots are on at most {count} of its sides", SOURCE_NEARBY)
    for sides in combinations(headings(world), count + 1):
        together = " & ".join(f"{busy(h)}'" for h in sides)
        yield Constraint(Section.ENV_TRANS, f"!({together})", few)
    if headings(world):
        # One condition for all sides needs one fixpoint instead of four.
        rule = f"infinitely often no robot is beside it ({', '.join(task.avoids)})"
        nobody = " & ".join(f"!{busy(heading)}'" for heading in headings(world))
        yield Constraint(Section.ENV_LIVENESS, nobody, Origin(task.item, rule, SOURCE_NEARBY))
