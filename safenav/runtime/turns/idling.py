"""Skipping of idle turns in live runs. Each pass gives each idle robot a turn, and most of them
only wait: neither their observations nor the decisions of the team are new. Such a turn, which
would repeat the last one without effect, is skipped.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable

from msgspec import Struct, field

from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.traffic.planning import Traffic
from safenav.runtime.turns.step_choice import StepChoice
from safenav.scenario.model import Tracking
from safenav.scenario.objective import Ltl


class Idling(Struct):
    """Turns without effect. ``simulated``: no sensor shows anything new by itself."""

    state: TeamState
    choice: StepChoice
    traffic: Traffic
    simulated: bool
    _idle: dict[str, Hashable] = field(default_factory=dict)

    def unless_idle(self, robot: RobotState, turn: Callable[[], object]) -> None:
        """Carry out a turn, unless it equals the last one, which changed nothing."""
        view = self._view(robot) if self.state.live else None
        if view is not None and self._idle.get(robot.name) == view:
            return
        before = None if view is None else self._traces(robot)
        turn()
        self._idle[robot.name] = view if before == self._traces(robot) else None

    def _view(self, robot: RobotState) -> Hashable | None:
        """A key of all that a robot's turn depends on; None if it may depend on more."""
        state, traffic, name = self.state, self.traffic, robot.name
        if self._is_engaged(robot):
            return None
        released = not traffic.plan.active or traffic.plan.released(name)
        known = robot.planner, state.changes - state.moves, robot.asked, traffic.plan.active
        if not released:
            return known if traffic.plan.next_pose(name) is None else None
        if robot.planner.node is None or traffic.plan.follows(name):
            return None
        seen = self.choice.observation(robot)
        if seen != robot.stays_for and (not self.simulated or state.graph(robot).one_way):
            return None  # regions beyond its neighbours may count, too
        return known, seen

    def _is_engaged(self, robot: RobotState) -> bool:
        """Whether a turn depends on more than its strategy, the plan and adjacent robots."""
        state, task = self.state, robot.planner.task
        if robot.transit is not None or robot.acting is not None or robot.held is not None:
            return True
        if not robot.active or state.waiting is not None or state.tick <= 1:
            return True
        if state.knowledge.pending and (robot.robot.capabilities or robot.assignment.obstacle):
            return True
        if robot.planner.switch is not None or task.tracking is not Tracking.NEARBY:
            return True
        formulas = isinstance(robot.progress.objective, Ltl) or isinstance(task.objective, Ltl)
        return formulas or robot.robot.model.battery is not None

    def _traces(self, robot: RobotState) -> Hashable:
        """A key of the state of a robot and of the trace, which changes if a turn has an effect."""
        planner, counts = robot.planner, (robot.own.mark, robot.progress.mark)
        left = robot.pose, robot.transit, robot.held, robot.acting, robot.asked, robot.begun
        node = planner, planner.node, planner.behind
        return self.state.emitted, self.state.changes, left, counts, node
