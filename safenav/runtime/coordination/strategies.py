"""The strategies in force: installation, nodes for present poses, and whether they suffice."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec import Struct

from safenav.runtime.coordination.coordination_recorder import synthesis_record
from safenav.runtime.coordination.strategy_search import TaskResult
from safenav.runtime.coordination.task_candidates import TaskDraft
from safenav.runtime.navigation import Planner
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.scenario.model import Tracking
from safenav.scenario.objective import Ltl
from safenav.spec.assignable import CommandInputs
from safenav.spec.assignable_regions import assignable_regions
from safenav.spec.other_robots.belief import models
from safenav.spec.task import Task
from safenav.trace import vocabulary


class Strategies(Struct, frozen=True):
    """Puts strategies in force for the robots of a team."""

    _state: TeamState

    def install(
        self,
        drafts: Mapping[str, TaskDraft],
        results: Mapping[str, TaskResult],
        reason: vocabulary.Reason,
    ) -> None:
        """Put assignments in force, with the strategies found for them. All assignments come first,
        so that each trace line is true when it is written."""
        robots = self._state.robots
        for name, draft in drafts.items():
            robots[name].assign(draft.assignment)
        for result in results.values():
            self._install(result, reason)
        for robot in robots.values():
            if not (robot.begun or self._state.has_had_turn(robot)) and robot.transit is None:
                self.begin(robot)

    def _install(self, found: TaskResult, reason: vocabulary.Reason) -> None:
        """Put a strategy in force; its robot must already have the assignment that it is for."""
        strategy = found.result.strategy
        assert strategy is not None
        state = self._state.robots[found.task.robot.name]
        planner = Planner.start(found.task, strategy)
        if found.task.assignable:
            planner.switch = CommandInputs(assignable_regions(found.task, self._state.scenario.map))
        if (
            found.form is vocabulary.Form.OTHER_MEMORY
            and state.assignment.role is Role.OWN
            and found.task.memory.index != state.own.memory.index
        ):
            state.own.begin_with(found.task.memory.index)
        state.take_over(planner)
        self._state.emit(synthesis_record(self._state, found, reason, planner.node))

    def begin(self, state: RobotState) -> None:
        """Count the goals that a robot has already met where it stands when its objective begins
        (in transit: when it arrives)."""
        state.begun = True
        met = state.progress.begin(state.pose.region, state.planner.values())
        self._state.tell_goals(state, met)

    def relocate(self, state: RobotState) -> bool:
        """Find the node of a robot's strategy for its pose and memory; return whether there is
        one."""
        planner = state.planner
        own = state.own.objective == planner.task.robot.objective and planner.task.assignable
        progress = state.own if own and not isinstance(state.own.objective, Ltl) else state.progress
        return planner.relocate(state.pose, progress, self._seen_now(state, planner.task))

    def catch_up(self, state: RobotState) -> None:
        """Let a robot that was held back after its last look continue in a node that remembers that
        look. Without one it stays in its node, which may suffice."""
        planner, node = state.planner, state.planner.node
        if not self._seen_now(state, planner.task) and planner.switch is None:
            planner.behind = False  # its nodes do not remember looks
        elif node is not None and not self.relocate(state):
            planner.node = node

    def _seen_now(self, state: RobotState, task: Task) -> dict[str, int]:
        """The inputs that a strategy remembers from the last step, as they are now."""
        found = {each.name: int(self._state.inputs[each.name]) for each, _ in task.inputs}
        if task.tracking is Tracking.NEARBY or not task.observed:
            return found
        if task.tracking is Tracking.EXACT:
            return found | {
                o.variable: self._state.robots[o.name].pose.region for o in task.observed
            }
        for model in models(task, self._state.scenario.map):
            other = model.other
            region = self._state.robots[other.name].pose.region
            known = self._state.beliefs.of(state.name, other.name, region)
            found[other.variable] = model.number(known)
        return found


def outdated(team: TeamState, name: str, draft: TaskDraft) -> bool:
    """Whether the strategy in force does not suffice for a draft: another objective, a wall that it
    does not know, a pose that it does not avoid; or there is none."""
    state = team.robots[name]
    if not state.active and draft.assignment == state.assignment:
        return False  # it requests a move when it is back
    return not state.has_strategy or _is_off(state) or _falls_short(team, state, draft)


def only_off(team: TeamState, name: str, draft: TaskDraft) -> bool:
    """Whether the strategy in force would suffice for a draft, but has no node for the robot's
    pose."""
    state = team.robots[name]
    return state.has_strategy and _is_off(state) and not _falls_short(team, state, draft)


def _is_off(state: RobotState) -> bool:
    """Whether a robot is in no node of its strategy; robots in transit find theirs on arrival."""
    return state.planner.node is None and state.transit is None and not state.arriving


def _falls_short(team: TeamState, state: RobotState, draft: TaskDraft) -> bool:
    old = state.planner.task
    if old.objective.relaxed() != draft.objective.relaxed():
        return True
    known = {(k.region, k.item) for k in old.blocked}
    walls = team.knowledge.walls_for(state.robot, draft.must)
    if not {(k.region, k.item) for k in walls} <= known:
        return True
    if not draft.forbidden <= old.forbidden:
        return True
    if old.tracking is Tracking.BELIEF and old.observed:
        return old.closed != team.knowledge.standing
    return False
