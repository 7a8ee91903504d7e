"""The specifications to try for a robot, the strongest form first.

The forms of its objective (``spec.forms``), and for each the weakest sufficient assumption about
other robots.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.deadlines.round_deadlines import (
    Walk,
    best_places,
    keep,
    least_within,
    next_places,
)
from safenav.runtime.formulas import permitted
from safenav.runtime.team import Assignment, RobotState, Role, TeamState
from safenav.scenario.model import Tracking
from safenav.scenario.objective import Ltl, Objective
from safenav.scenario.settings import Coordination
from safenav.spec.forms import ObjectiveForm, forms
from safenav.spec.objective import Memory
from safenav.spec.other_robots.knowledge import Knowledge
from safenav.spec.task import FAIRNESS_ORDER, Fairness, Observed, Task
from safenav.world.moves import Pose
from safenav.world.partition import Partition
from safenav.world.poses import region_mask


class TaskDraft(Struct, frozen=True):
    """A synthesis task before its form is chosen: ``objective`` (with assignable goals not that of
    its ``assignment``). ``avoid``: pending obstacles that it treats as walls, ``must``: those of
    them that an existing strategy must know. ``forbidden``: poses that it must avoid for the team;
    ``places``: the only poses in which it enters its first target (empty: any)."""

    assignment: Assignment
    objective: Objective
    avoid: frozenset[str] = frozenset()
    must: frozenset[str] = frozenset()
    forbidden: frozenset[Pose] = frozenset()
    places: frozenset[Pose] = frozenset()


class Candidate(Struct, frozen=True):
    """A specification to try: a task with a ``form`` of the objective ``asked`` for."""

    asked: Objective
    form: ObjectiveForm
    task: Task


def task_candidates(team: TeamState, name: str, draft: TaskDraft) -> list[Candidate]:
    """Return the candidates of a robot for the team's present knowledge: the strongest form of its
    objective and the weakest assumption first."""
    state, found = team.robots[name], list[Candidate]()
    for form, memory in _forms(team, state, draft):
        task = _task(team, state, draft, form.objective, memory)
        places = goal_places(team, state, draft, form.objective, memory)
        tried = [] if places is None else [places]
        if places and draft.places and team.rivals(state.robot):
            tried.append(())  # among other robots, finally any poses
        for choice in tried:
            tasks = (replace(task, goal_places=choice, fairness=each) for each in rungs(task))
            found += [Candidate(draft.objective, form, task) for task in tasks]
    return found


def _forms(
    team: TeamState, robot: RobotState, draft: TaskDraft
) -> Iterator[tuple[ObjectiveForm, Memory]]:
    assigned = team.scenario.coordination is Coordination.ASSIGNABLE
    strict = draft.objective.strict
    own = draft.assignment.role is Role.OWN or assigned
    memory = robot.next_memory if own or isinstance(draft.objective, Ltl) else Memory()
    walls = team.knowledge.walls_for(robot.robot, draft.avoid)
    found = forms(
        draft.objective,
        robot.own.memory.index if strict else memory.index,
        robot.next_pose,
        team.graph(robot),
        region_mask(known.region for known in walls),
        shared=bool(team.rivals(robot.robot)),
        assigned=assigned,
        charged=robot.robot.model.battery is not None and bool(team.scenario.chargers),
    )
    for rung in found:
        yield rung, Memory(rung.turn) if strict else memory


def wants_places(team: TeamState, robot: RobotState, draft: TaskDraft) -> bool:
    """Whether a robot must meet its targets in the poses of short rounds: it has a round deadline,
    no other robot is on its floor, and no obstacle in its way."""
    own = draft.assignment.role is Role.OWN and not isinstance(draft.objective, Ltl)
    if draft.assignment.role is Role.CHARGES and robot.stop is not None:
        return robot.stop.heading is not None and not team.rivals(robot.robot)
    if robot.robot.within is None or not own or team.rivals(robot.robot):
        return False
    graph = team.graph(robot)
    plain = team.scenario.coordination is not Coordination.ASSIGNABLE and not draft.forbidden
    several = any(len(target) > 1 for target in draft.objective.targets)
    walls = {known.region for known in team.knowledge.walls_for(robot.robot, draft.avoid)}
    return plain and (graph.one_way or several) and walls <= robot.robot.objective.avoid


def alone(task: Task) -> Task | None:
    """The task without other robots, if the robot's own rules may be unrealizable; None if its
    strategy assumes nothing about others, or it has no such rules.

    A strategy that exists only because of an assumption may win by making that fail: by standing
    where another robot must go (Klein and Pnueli, Revisiting synthesis of GR(1) specifications, HVC
    2010).
    """
    ruled = isinstance(task.objective, Ltl) or task.objective.always
    if task.fairness is Fairness.NONE or not ruled:
        return None
    watched = tuple(other for other in task.observed if not other.danger)
    return replace(task, observed=watched, fairness=Fairness.NONE, exclusive=False)


def goal_places(
    team: TeamState, robot: RobotState, draft: TaskDraft, objective: Objective, memory: Memory
) -> tuple[frozenset[Pose], ...] | None:
    """The poses in which to meet the targets of a form of its objective, so that rounds meet their
    deadline, or are as short as possible; None if no choice does. An empty tuple: any poses."""
    graph = team.graph(robot)
    if draft.places and not isinstance(objective, Ltl):
        return draft.places, *map(graph.poses, graph.on_each(objective.targets[1:]))
    if not wants_places(team, robot, draft):
        return ()
    if draft.assignment.role is Role.CHARGES and robot.stop is not None:
        return (frozenset({robot.stop}),)
    walk, most = _walk(team, robot, objective, memory), robot.robot.within or 0
    found = best_places(walk, most) or next_places(walk, most)
    if found is None and not walk.strict:
        found = best_places(walk, least_within(walk) or most)
    if found is None:
        return None if walk.strict and not objective.literal else ()
    return tuple(map(graph.poses, found))


def _walk(team: TeamState, robot: RobotState, objective: Objective, memory: Memory) -> Walk:
    """The rounds of a robot from its next pose."""
    graph, pose = team.graph(robot), robot.next_pose
    turned = memory.index
    if not isinstance(objective, Ltl):
        turned = objective.turned(objective.begin(pose.region, memory.index), pose.region)
    targets = graph.on_each(objective.targets)
    ticks, strict = robot.robot.model.timing.most, objective.strict
    allowed = permitted(robot.robot, graph)
    return Walk(graph, targets, allowed, graph.number(pose), ticks, turned, strict=strict)


def misses_its_rounds(team: TeamState, robot: RobotState) -> bool:
    """Whether a robot that begins a round misses its deadline with the poses of its present
    strategy, but not with others."""
    task = robot.planner.task
    if not task.goal_places or robot.assignment.role is not Role.OWN:
        return False
    within, walk = robot.robot.within, _walk(team, robot, task.objective, robot.memory)
    number = walk.graph.number
    places = tuple(region_mask(map(number, target)) for target in task.goal_places)
    late = within is not None and not keep(walk, places, within)
    return late and next_places(walk, within or 0) is not None


def _task(
    team: TeamState, state: RobotState, draft: TaskDraft, objective: Objective, memory: Memory
) -> Task:
    """The task of a robot from the pose of its next decision."""
    robot = state.robot
    observed = []
    for other in team.robots.values():
        if other is state:
            continue
        danger = team.scenario.interfere(robot, other.robot)
        if danger or other.name in robot.tracks:
            observed.append(_observed(team, state, other, danger))
    cells = team.scenario.partition
    return Task(
        robot=robot,
        pose=state.next_pose,
        objective=objective,
        memory=memory,
        blocked=team.knowledge.walls_for(robot, draft.avoid),
        observed=tuple(observed),
        tracking=robot.tracking,
        assignable=team.scenario.coordination is Coordination.ASSIGNABLE,
        partition=None if cells is None else Partition(cells),
        closed=team.knowledge.standing,
        forbidden=draft.forbidden,
        inputs=tuple(
            (each, team.inputs[each.name])
            for each in team.scenario.inputs
            if isinstance(objective, Ltl) and each.name in objective.inputs
        ),
        exclusive=any(robot.name in each.robots for each in team.scenario.never_together),
        live=team.live,
    )


def _observed(team: TeamState, state: RobotState, other: RobotState, danger: bool) -> Observed:
    """Return what a robot knows about ``other``: its region, or a belief."""
    here, targets = other.next_pose.region, other.assignment.objective.targets
    known: Knowledge = here
    if state.robot.tracking is Tracking.BELIEF:
        known = team.beliefs.of(state.name, other.name, here)
    seen, belief = (here, known) if isinstance(known, frozenset) else (known, None)
    return Observed(other.name, seen, targets, danger, belief)


def rungs(task: Task) -> tuple[Fairness, ...]:
    """Return the assumptions that a task can make about others, from weakest to strongest, without
    those that cannot suffice.

    With ``nearby`` tracking, others can block any moving robot forever: one in the way may always
    be on the side of the target. So only a robot already at its destination needs no assumption.
    """
    if not task.endangered:
        return (Fairness.NONE,)
    objective = task.objective
    if task.tracking is Tracking.NEARBY and not isinstance(objective, Ltl):
        targets = task.targets
        settled = len(targets) == 1 and (objective.settles or objective.in_turn)
        if task.assignable or not (settled and task.pose.region in targets[0]):
            return (Fairness.OUT_OF_MY_WAY,)
    return FAIRNESS_ORDER[task.tracking]
