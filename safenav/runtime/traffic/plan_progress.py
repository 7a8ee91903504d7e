"""Progress of the team on its joint plan: each robot's next pose, and the regions and charge still
needed.

Robots follow a plan up to the first resolution, or until each robot with goal poses has reached
them once; in a live run often to its end.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise
from math import ceil

from msgspec.structs import replace

from safenav.begun import PlanLeft
from safenav.components import explored
from safenav.runtime.coordination.snapshot import awaited_by
from safenav.runtime.formulas import formulas_of
from safenav.runtime.resolution.problem import Floor
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.runtime.traffic.joint_search import execution
from safenav.runtime.traffic.joint_search.formula_memory import plain_poses
from safenav.runtime.traffic.joint_search.states import Count, JointState, has_met
from safenav.runtime.traffic.searches import Searches
from safenav.trace import records, vocabulary
from safenav.world.moves import Pose
from safenav.world.poses import Mask


class PlanProgress:
    """The joint plan that a team follows, if any (``execution``)."""

    def __init__(self, state: TeamState, searches: Searches) -> None:
        self.state = state
        self.searches = searches
        self.execution: execution.Execution | None = None

    @property
    def active(self) -> bool:
        return self.execution is not None

    def _index(self, name: str) -> int:
        return self.state.last_settled.floor.index(name)

    def next_pose(self, name: str) -> Pose | None:
        """Return the next pose of a robot by the plan. None if it stays: it has finished, waits for
        robots before it, has not yet counted the goals that the plan assumes, or charges."""
        assert self.execution is not None
        floor, index = self.state.last_settled.floor, self._index(name)
        due = self.execution.due(index)
        if due is not None and not self._has_met(floor, index, due):
            return None
        number = self.execution.next(index)
        if number is None or self._charges(self.state.robots[name]):
            return None
        return floor.problem.members[index].graph.pose(number)

    def _has_met(self, floor: Floor, index: int, due: Count) -> bool:
        """Return whether a robot has met the goals in ``due``, or cannot meet them by waiting: it
        has another assignment or is out of service, its goals are steps, or none of its remaining
        targets is here."""
        name, graph = floor.names[index], floor.problem.members[index].graph
        robot = self.state.robots[name]
        formulas = formulas_of(robot.robot, self.state.scenario.map)
        if robot.assignment.role is not Role.OWN or (formulas and not formulas.met_by_staying):
            return True
        here = graph.number(robot.pose)
        if not robot.active or not awaited_by(floor, name, robot.own) >> here & 1:
            return True
        return has_met(self.searches.counts(floor)[index], due)

    def arrived(self, name: str) -> None:
        """Record that a robot has taken its next step of the plan."""
        if self.execution is not None:
            self.execution.arrived(self._index(name))

    def released(self, name: str) -> bool:
        """Return whether a robot has completed its part of the plan. Live, it may leave the plan
        before the others: ``ahead`` is closed to it, and irreversible moves must be
        ``certified``."""
        return self.execution is not None and self.execution.done(self._index(name))

    def goes_on_without(self, robot: RobotState) -> bool:
        """Live: return whether the plan only moves robots that do not wait for this one, directly
        or indirectly. In lockstep every robot stays during a plan."""
        if self.execution is None or self.execution.finished or not self.state.live:
            return False
        robots, rivals = self.state.robots, self.state.rivals
        near = explored([robot.name], lambda name: [o.name for o in rivals(robots[name].robot)])
        return all(self.execution.done(self._index(name)) for name in near)

    def takes(self, robot: RobotState) -> int | None:
        """Return the charge that a robot needs for the remaining plan, up to its next charger, or
        up to the end including its need there; None if the plan no longer holds it. In lockstep a
        robot that has arrived waits for the end of the plan."""
        index, stops = self._index(robot.name), self.state.stops(robot)
        arrived = self.released(robot.name)
        if self.execution is None or stops is None or (arrived and self.state.live):
            return None
        if arrived and robot.pose.region in self.state.scenario.chargers:
            return 0
        path, turn = self.execution.remaining(index)
        turn = stops.turn(robot.own.memory.index if turn is None else turn)
        return stops.takes_way(path, turn) + (ceil(stops.battery.stay) if arrived else 0)

    def _charges(self, robot: RobotState) -> bool:
        """Return whether a robot waits on a charger for the charge for the rest of the plan."""
        takes, battery = self.takes(robot), robot.robot.model.battery
        if takes is None or battery is None or robot.charge is None:
            return False
        on_charger = robot.pose.region in self.state.scenario.chargers
        return on_charger and robot.charge < takes <= battery.capacity

    def follows(self, name: str) -> bool:
        """Return whether a robot has followed its helper by a plan, and waits there for the next
        decision."""
        return name in self.state.last_settled.notes.followers

    def ahead(self, name: str) -> Mask:
        """Return the regions that robots in conflict with this one still need for the plan."""
        if self.execution is None:
            return 0
        floor = self.state.last_settled.floor
        index = floor.index(name)
        return execution.still_needed(floor.problem, self.execution, index)

    def changes_nothing(
        self, floor: Floor, states: Sequence[JointState], counts: Sequence[Count]
    ) -> bool:
        """Return whether a plan moves no robot, and none has to wait for a goal."""
        if len({state.poses for state in states}) > 1:
            return False
        dues = enumerate(execution.required_counts(states, counts))
        return all(self._has_met(floor, i, count) for i, due in dues for count in due.values())

    def begin(
        self, floor: Floor, states: Sequence[JointState], counts: Sequence[Count], reason: str
    ) -> None:
        """Begin to follow a plan. Robots in transit continue to its start."""
        poses = [plain_poses(floor.problem, state.poses) for state in states]
        under_way = {}
        for index, robot in enumerate(self.state.robots.values()):
            if robot.transit is not None:
                under_way[index] = floor.problem.members[index].graph.number(robot.pose)
                robot.transit = replace(robot.transit, by=vocabulary.MovedBy.PLAN)
        poses, states = execution.with_steps_under_way(poses, states, counts, under_way)
        self.state.changes += 1
        self._follow(floor, poses, states, counts, reason, under_way)

    def _follow(
        self,
        floor: Floor,
        poses: Sequence[tuple[int, ...]],
        states: Sequence[JointState],
        counts: Sequence[Count],
        reason: str,
        under_way: Collection[int] = (),
    ) -> None:
        """Begin to follow a plan with these joint poses and states."""
        apart = floor.problem.separation
        plan = execution.schedule(apart, poses, under_way)
        self.execution = execution.Execution(plan, execution.required_counts(states, counts))
        self.state.emit(execution.plan_record(self.state.tick, floor, plan, reason))

    def end(self, reason: vocabulary.PlanEndReason, nodes: Mapping[str, int | None] | None) -> None:
        """End the plan, if there is one. ``nodes``: each robot's next strategy node."""
        if self.execution is not None:
            self.execution = None
            self.state.changes += 1
            self.state.emit(records.PlanEnd(self.state.tick, reason, nodes))

    def resume(self, left: PlanLeft) -> None:
        """Continue the plan of the earlier run, if each of its remaining steps is possible."""
        floor, notes = self.searches.floor(), self.state.last_settled.notes
        notes.followed = notes.cleared = True
        plan = execution.scheduled(floor, left)
        joint = None if plan is None else execution.in_turn(plan)
        if plan is None or joint is None or joint[0] != floor.poses:
            return
        counts, course = self.searches.counts(floor), self.searches.course(floor)
        states = course.along(course.begun(floor.poses, counts, floor.stages), joint[1:])
        if not all(after.poses in course.next_poses(state) for state, after in pairwise(states)):
            return  # the scenario has changed
        self._follow(floor, joint, states, counts, left.reason)
