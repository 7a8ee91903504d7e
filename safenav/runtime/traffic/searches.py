"""Joint searches from where the team stands: the floor as coordination decided it, the rounds that
a plan looks ahead, what each robot has counted, and what it is told."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from safenav.runtime.coordination.duties import settle
from safenav.runtime.coordination.floor import Floor, awaited_by, counts_of
from safenav.runtime.coordination.problem import SpentError, Stages
from safenav.runtime.over import Stop
from safenav.runtime.poses import Mask
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.runtime.traffic.aim import Aims
from safenav.runtime.traffic.joint import Count, Course, Joint
from safenav.runtime.traffic.joint_plan import Search
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.objective import Ltl
from safenav.synthesis.strategy import Strategy
from safenav.world.moves import Pose

if TYPE_CHECKING:
    from safenav.runtime.coordination.algorithm import Coordinator

AHEAD = 2
"""Rounds beyond those that the fastest robot has done that a plan looks ahead."""


class Searches:
    """What a search for a joint plan starts from now, and such searches."""

    def __init__(self, state: TeamState, coordination: Coordinator, stop: Stop) -> None:
        self._state = state
        self._coordination = coordination
        self._stop = stop
        self._aims: dict[str, Aims] = {}

    def floor(self) -> Floor:
        """The problem that coordination decided about, with everybody where they are now."""
        decided = self._coordination.floor
        poses = tuple(
            member.graph.number(robot.next_pose)
            for member, robot in zip(
                decided.problem.members, self._state.robots.values(), strict=True
            )
        )
        return replace(decided, poses=poses)

    def aimed(self, floor: Floor) -> Floor:
        """The problem with the next pose of its strategy's way for each robot whose formulas
        remember something, in place of all that may be a goal of it."""
        members = list(floor.problem.members)
        changed = False
        for index, robot in enumerate(self._state.robots.values()):
            objective = robot.robot.objective
            if not isinstance(objective, Ltl) or robot.planner is None or not robot.active:
                continue
            if not guarantees_of(objective).remember_something:
                continue
            if robot.assignment.role is not Role.OWN or self._has_done_all(robot):
                continue
            aim = self._aim(robot, objective)
            if aim is not None:
                goal = 1 << members[index].graph.number(aim)
                members[index] = replace(members[index], targets=(goal,))
                changed = True
        if not changed:
            return floor
        return replace(floor, problem=replace(floor.problem, members=tuple(members)))

    def _aim(self, robot: RobotState, objective: Ltl) -> Pose | None:
        """Where a robot is going by its own strategy, if somebody lists that."""
        planner = robot.planner
        if planner is None or planner.node is None or not isinstance(planner.strategy, Strategy):
            return None
        aims = self._aims.get(robot.name)
        if aims is None or aims.strategy is not planner.strategy:
            aims = self._aims[robot.name] = Aims(planner.strategy, objective)
        return aims.aim(planner.node, robot.own.seen)

    def _has_done_all(self, robot: RobotState) -> bool:
        return robot.own.rounds >= self._state.scenario.until.rounds

    def goal(self, floor: Floor, name: str) -> Mask:
        """The poses that a robot is to reach now; none for one that waits or has done all."""
        robot = self._state.robots[name]
        match robot.assignment.role:
            case _ if not robot.active:
                return 0
            case Role.HELPS:
                return robot.assignment.goal
            case Role.OWN if not self._has_done_all(robot):
                return awaited_by(floor, name, robot.own)
            case _:
                return 0

    def course(self, floor: Floor) -> Course:
        """The rounds that a plan from here looks ahead."""
        wanted = self._state.scenario.until.rounds
        done = max(robot.own.rounds for robot in self._state.robots.values())
        return Course(floor.problem, min(wanted, done + AHEAD))

    def counts(self, floor: Floor, rounds: int) -> tuple[Count, ...]:
        """What each robot has met so far, up to so many rounds."""
        owns = {name: robot.own for name, robot in self._state.robots.items()}
        return counts_of(floor, owns, rounds)

    def search(
        self, floor: Floor, course: Course, start: Joint, wishes: Mapping[int, Mask] | None = None
    ) -> Search:
        """A search for a plan. ``wishes``: of robots at first, in place of what they are told."""

        def guide(stages: Stages, poses: tuple[int, ...]) -> list[Mask | None]:
            found = self._guide(floor, stages, poses)
            for robot, wish in (wishes or {}).items() if stages == start.stages else ():
                found[robot] = wish
            return found

        return Search(
            course,
            guide,
            start,
            course.completed,
            seed=self._state.scenario.seed + self._state.tick,
            stopping=self._stop.check,
        )

    def _guide(self, floor: Floor, stages: Stages, poses: tuple[int, ...]) -> list[Mask | None]:
        """What coordination would tell each robot at a stage."""
        if stages == floor.stages:
            wishes: list[Mask | None] = []
            for robot in self._state.robots.values():
                match robot.assignment.role:
                    case Role.HELPS:
                        wishes.append(robot.assignment.goal)
                    case Role.WAITS:
                        wishes.append(0)
                    case _:
                        wishes.append(None)
            return wishes
        requests = floor.problem.open(stages)
        try:
            found = settle(self._coordination.solver, poses, stages, requests, {})
        except SpentError:
            return [None] * len(poses)
        return [found.duties[i].goal if i in found.duties else None for i in range(len(poses))]
