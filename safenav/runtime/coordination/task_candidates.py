"""The specifications to try for a robot, the strongest form first.

The forms of its objective (``spec.forms``), and for each the weakest sufficient assumption about
other robots.
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct
from msgspec.structs import replace

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
    them that an existing strategy must know. ``forbidden``: poses that it must avoid for the
    team."""

    assignment: Assignment
    objective: Objective
    avoid: frozenset[str] = frozenset()
    must: frozenset[str] = frozenset()
    forbidden: frozenset[Pose] = frozenset()


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
        tasks = (replace(task, fairness=each) for each in rungs(task))
        found += [Candidate(draft.objective, form, each) for each in tasks]
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
