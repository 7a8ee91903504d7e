"""What a robot is to be synthesized for: a ladder of specifications, the strongest form first.

The forms of its objective (``spec.forms``), and for each the weakest assumption about others that
will do.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from safenav.dataclass import dataclass
from safenav.runtime.formulas import plain_graph
from safenav.runtime.team import Assignment, RobotState, Role, TeamState
from safenav.scenario.model import Coordination, Tracking
from safenav.scenario.objective import Hold, Ltl, Objective, Patrol, Target, Visit, targets_of
from safenav.spec.forms import Rung, forms
from safenav.spec.objective import Memory
from safenav.spec.task import LADDERS, Fairness, Observed, Task
from safenav.world.map import Region
from safenav.world.moves import Pose
from safenav.world.partition import Partition
from safenav.world.poses import region_mask


@dataclass(frozen=True)
class Errand:
    """What one robot is to be synthesized for: ``objective`` (with assignable goals not that of
    its ``assignment``). ``avoid``: pending obstacles that it takes for walls, ``must``: those that
    a strategy which it has must know, too. ``forbidden``: poses that it must keep out of for the
    team's sake."""

    assignment: Assignment
    objective: Objective
    avoid: frozenset[str] = frozenset()
    must: frozenset[str] = frozenset()
    forbidden: frozenset[Pose] = frozenset()


Candidate = tuple[Rung, Task]


@dataclass(frozen=True)
class Ladder:
    """Makes the tasks of robots from what the team knows now."""

    state: TeamState

    def candidates(self, name: str, errand: Errand) -> Iterator[Candidate]:
        """The specifications to try for a robot: the strongest form of its objective and the
        weakest assumption first."""
        state = self.state.robots[name]
        for rung, memory in self._forms(state, errand):
            task = self._task(state, errand, rung.objective, memory)
            for fairness in rungs(task):
                yield rung, replace(task, fairness=fairness)

    def _forms(self, state: RobotState, errand: Errand) -> Iterator[tuple[Rung, Memory]]:
        patrol = isinstance(errand.objective, Patrol)
        own = errand.assignment.role is Role.OWN or self._is_assignable
        memory = state.memory if own or isinstance(errand.objective, Ltl) else Memory()
        walls = self.state.knowledge.walls_for(state.robot, errand.avoid)
        found = forms(
            errand.objective,
            state.own.memory.index if patrol else memory.index,
            state.next_pose,
            plain_graph(self.state.scenario.map, state.robot.model.mobility),
            region_mask(known.region for known in walls),
            shared=bool(self.state.rivals(state.robot)),
            assigned=self._is_assignable,
        )
        for rung in found:
            yield rung, Memory(rung.turn) if patrol else memory

    @property
    def _is_assignable(self) -> bool:
        return self.state.scenario.coordination is Coordination.ASSIGNABLE

    def _task(
        self, state: RobotState, errand: Errand, objective: Objective, memory: Memory
    ) -> Task:
        """What a robot is to be synthesized for, from where it can next decide anything."""
        team, robot = self.state, state.robot
        observed = []
        for other in team.robots.values():
            if other is state:
                continue
            danger = team.scenario.conflict(robot, other.robot)
            if danger or other.name in robot.tracks:
                targets = targets_of(other.assignment.objective)
                observed.append(self._observed(state, other, targets, danger))
        cells = team.scenario.partition
        return Task(
            robot=robot,
            pose=state.next_pose,
            objective=objective,
            memory=memory,
            blocked=team.knowledge.walls_for(robot, errand.avoid),
            observed=tuple(observed),
            tracking=robot.tracking,
            assignable=self._is_assignable,
            partition=None if cells is None else Partition(cells),
            closed=team.knowledge.standing,
            forbidden=errand.forbidden,
        )

    def _observed(
        self, state: RobotState, other: RobotState, targets: tuple[Target, ...], danger: bool
    ) -> Observed:
        """``other`` as a robot knows it: where it is, or what is believed of it."""
        where: Region = other.next_pose.region
        if state.robot.tracking is Tracking.BELIEF:
            known = self.state.beliefs.of(state.name, other.name, where)
            if isinstance(known, frozenset):
                return Observed(other.name, where, targets, danger, known)
            where = known
        return Observed(other.name, where, targets, danger)


def rungs(task: Task) -> tuple[Fairness, ...]:
    """The assumptions that a task can make about others, from weakest to strongest, without
    those that cannot do.

    By what is next to it, a robot that has anywhere to go can be kept from it for ever: whoever is
    in the way may always be on the side of the target. So only one that is where it stays needs no
    assumption.
    """
    if not task.endangered:
        return (Fairness.NONE,)
    objective = task.objective
    if task.tracking is Tracking.NEARBY and not isinstance(objective, Ltl):
        targets = task.targets
        settled = isinstance(objective, Hold | Visit) and len(targets) == 1
        if task.assignable or not (settled and task.pose.region in targets[0]):
            return (Fairness.OUT_OF_MY_WAY,)
    return LADDERS[task.tracking]
