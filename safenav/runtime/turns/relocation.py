"""Robots off their strategies: how they continue after a joint plan, a failed step, or a time out
of service."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from msgspec import Struct

from safenav.outcome import Outcome
from safenav.runtime.characterization import ForbiddenMove
from safenav.runtime.coordination import events
from safenav.runtime.coordination.events import Event
from safenav.runtime.coordination.strategies import Strategies
from safenav.runtime.team import RobotState, TeamState
from safenav.runtime.termination import Conclusion
from safenav.runtime.traffic.planning import Traffic
from safenav.spec.specification import Constraint
from safenav.trace.vocabulary import ChangeCause, PlanEndReason, Reason

_BY = {ChangeCause.SCENARIO: "by a change of the scenario", ChangeCause.USER: "by an operator"}
"""The agent that takes a robot out of service."""


class Relocation(Struct, frozen=True):
    """Finds the nodes from which robots continue; if a strategy has none, an event requests another
    strategy."""

    state: TeamState
    strategies: Strategies
    traffic: Traffic

    def leave_plan(
        self, reason: PlanEndReason = PlanEndReason.CHANGED, *, settling: bool = True
    ) -> Iterator[Event]:
        """End the joint plan: every robot continues with a strategy that has a node for its pose.
        ``settling``: new strategies come with the decision right after this."""
        if not self.traffic.plan.active:
            return
        for robot in self._off_their_strategies():
            self.strategies.relocate(robot)
        nodes = {name: robot.planner.node for name, robot in self.state.robots.items()}
        self.traffic.end(reason, nodes)
        for robot in () if settling else self._off_their_strategies():
            yield events.OutsideStrategy(robot.name, Reason.PLAN)

    def request_help(self, violation: ForbiddenMove) -> Iterator[Event]:
        """Request help with an obstacle that a robot has encountered where it stands."""
        yield from self.leave_plan(PlanEndReason.VIOLATION)
        yield events.ObstacleEncountered(violation)
        yield events.HelpRequested(violation)

    def _off_their_strategies(self) -> list[RobotState]:
        """The robots that are not in transit and in no node of their strategy."""
        return [
            robot
            for robot in self.state.robots.values()
            if robot.transit is None and robot.planner.node is None
        ]

    def serve(self, robot: RobotState, *, active: bool, cause: ChangeCause) -> Iterator[Event]:
        """Put a robot in or out of service. While it is out, other robots take over its duties if
        they can, and its own objective waits."""
        if robot.active != active:
            if cause in _BY:
                self.state.failures.out[robot.name] = _BY[cause]
            yield from self.leave_plan()
            yield events.ServiceChanged(robot.name, active, cause)

    def put_in_service(self, robot: RobotState, *, active: bool) -> None:
        """Put a robot in or out of service. One that is back continues from its pose; if it needs a
        new strategy, the decision right after this provides one."""
        robot.active = active
        if active:
            self.state.failures.back(robot.name)
        if not active or robot.transit is not None:
            return
        robot.planner.node = None
        pursued = robot.progress.objective.relaxed()
        if robot.planner.task.objective.relaxed() == pursued:
            self.strategies.relocate(robot)  # otherwise its assignment has changed

    def go_on(self, robot: RobotState) -> Iterator[Event]:
        """Continue a robot off its strategy from its pose, in that strategy if it has a node for
        the pose."""
        if robot.planner.node is not None or not robot.active:
            return
        if not self.strategies.relocate(robot):
            yield events.OutsideStrategy(robot.name, Reason.PLAN)

    def go_on_from_elsewhere(self, robot: RobotState) -> Iterator[Event]:
        """Continue from the pose that the world reports if it is not the commanded one."""
        self.is_placed(robot)
        if self.traffic.plan.active:
            yield from self.leave_plan(settling=False)
        else:
            yield from self.go_on(robot)

    def is_placed(self, robot: RobotState) -> None:
        """Process a robot's pose that its strategy did not lead to. If the robot is at its next
        target, the strategy that begins there counts the target as met."""
        robot.planner.node = None
        if robot.pose.region in robot.progress.awaited():
            robot.begun = False
        else:
            robot.progress.leave()

    def find_a_way_back(self, robot: RobotState, broken: Sequence[Constraint]) -> Iterator[Event]:
        """Find another node of the robot's strategy, or a new one, as it has no successor."""
        if self.strategies.relocate(robot):
            return
        rules = "; ".join(dict.fromkeys(constraint.origin.rule for constraint in broken))
        end = Conclusion(
            Outcome.ASSUMPTION_VIOLATED,
            f"the other robots violated an assumption of {robot.name}"
            f"{f' ({rules})' if rules else ''}, which has no strategy from here",
        )
        if broken:
            yield events.OutsideStrategy(robot.name, Reason.BLOCKED, end)
            return
        # A joint plan ended in a pose where its formulas forbid it to stay: another may help.
        end = Conclusion(Outcome.OPERATOR_NEEDED, f"{robot.name} has no strategy from here")
        helped = self.state.frees(robot.name)
        yield events.OutsideStrategy(robot.name, Reason.BLOCKED, None if helped else end)
