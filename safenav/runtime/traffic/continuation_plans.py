"""Irreversible moves: each requires a plan for the whole mission from its destination.

A plan certifies its own moves, so results are cached; and the last plan is reused wherever the team
can return to it. Robots out of service may come back, so a move must not rule out a plan for the
team with all of them either.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from itertools import pairwise

from msgspec.structs import replace

from safenav.runtime.resolution.problem import Floor
from safenav.runtime.team import TeamState
from safenav.runtime.traffic import budgets
from safenav.runtime.traffic.joint_search.formula_memory import StateGraph, plain_poses
from safenav.runtime.traffic.joint_search.states import Answer, Course, Effort, Found, JointState
from safenav.runtime.traffic.searches import Searches, SearchProblem
from safenav.world.moves import Pose
from safenav.world.poses import Mask, region_mask


class ContinuationPlans:
    """Moves of a team that are proven to leave the mission feasible, and its last plan.
    ``in_service``: for the team as if every robot were in service."""

    def __init__(self, state: TeamState, searches: Searches, *, in_service: bool = False) -> None:
        self._state = state
        self._all = in_service
        self._searches = searches
        self._last: tuple[Course, Sequence[JointState]] | None = None
        self._known: dict[JointState, bool] = {}
        self._about: Hashable = None
        self._work = Effort(budgets.CERTIFICATE_WORK)

    def allow(self, name: str, pose: Pose) -> bool:
        """Return whether a robot may make a move that may be irreversible: it can return while all
        others stand, or a plan for the whole mission exists from there (or, with every robot in
        service, none exists without the move either)."""
        if self._all and not self._state.out_of_service:
            return True
        return all(
            self._returns(floor, index, step)
            or self._continues(floor, index, step)
            or (self._all and not self._continues(floor, index, floor.poses[index]))
            for floor, index, step in self._steps(name, pose)
        )

    def undone(self, name: str, pose: Pose, ahead: Mask) -> bool:
        """Return whether a robot that has left the joint plan early can return from a move without
        entering the regions that the others have ``ahead``. After undoing all such moves in reverse
        order, the rest of the plan is the certificate again."""
        steps = self._steps(name, pose)
        return all(self._returns(floor, index, step, ahead) for floor, index, step in steps)

    def _steps(self, name: str, pose: Pose) -> list[tuple[Floor, int, int]]:
        """Return the poses (with memory, by number) to which a move leads, each with the floor and
        the robot's index there; empty where moves can always be undone."""
        searches = self._searches
        floor = searches.in_service() if self._all else searches.remembered(searches.floor())
        index = floor.index(name)
        member = floor.problem.members[index]
        if not member.turns or not floor.problem.interferes(index):
            return []
        number, here = member.graph.number(pose), floor.poses[index]
        graph = member.graph
        steps = graph.after(here, number) if isinstance(graph, StateGraph) else [number]
        return [(floor, index, step) for step in steps]

    def _returns(self, floor: Floor, index: int, number: int, ahead: Mask = 0) -> bool:
        """Return whether a robot can return from a pose while all others stand."""
        graph = floor.problem.members[index].graph
        others = self._state.had_by_others(self._state.scenario.robots[index])
        closed = region_mask(others) | ahead
        allowed = floor.problem.allowed(index, floor.stages) & ~graph.poses_on(closed)
        return graph.returns(number, floor.poses[index], allowed)

    def ends_well(self, problem: SearchProblem, state: JointState) -> bool:
        """Return whether the mission can be completed from the end of a plan once every robot is in
        service, or could not be completed without the plan either."""
        if not (self._state.out_of_service and self._searches.turning):
            return True
        rest = self._rest(self._searches.in_service())
        poses = plain_poses(problem.floor.problem, state.poses)
        there = rest.course.begun(poses, state.counts, state.stages)
        return self._possible(rest.at(there)) or not self._possible(rest)

    def _continues(self, floor: Floor, index: int, number: int) -> bool:
        """Return whether a plan for the whole mission exists with a robot in a pose."""
        poses = (*floor.poses[:index], number, *floor.poses[index + 1 :])
        return self._possible(self._rest(floor, poses))

    def _rest(self, floor: Floor, poses: tuple[int, ...] | None = None) -> SearchProblem:
        """Return the search problem for the whole mission."""
        course, goals = self._searches.course(floor), self._searches.own_of_charging()
        if self._all:
            course = replace(course, excused=frozenset())
            goals |= dict.fromkeys(self._searches.cut_off(floor))
        return replace(self._searches.problem(floor, course, poses), goals=goals)

    def _possible(self, problem: SearchProblem) -> bool:
        """Return whether a plan for the whole mission exists from a joint state."""
        course, start = problem.course, problem.start
        self._concern(course)
        known = self._known.get(start)
        if known is None:
            answer: Answer | None = self.again(course, start)
            if answer is None and self._work.done:
                return False
            if answer is None:
                search = self._searches.search(problem, work=self._work)
                answer = search.run(*budgets.CERTIFICATE)
            known = isinstance(answer, Found)
            if len(self._known) > budgets.CERTIFICATES_KEPT:
                self._known.clear()
            self._known[start] = known
            if isinstance(answer, Found):
                self.keep(course, answer.states)
        return known

    def again(self, course: Course, start: JointState) -> Found | None:
        """Return the last plan for this whole mission, preceded by a return to it; None if there is
        none."""
        if self._last is None:
            return None
        of, states = self._last
        if of.problem is not course.problem or of.rounds != course.rounds:
            return None
        found = rejoined(course, start, states)
        return None if found is None else Found(found)

    def keep(self, course: Course, states: Sequence[JointState]) -> None:
        """Keep the rest of a plan as the continuation plan of its moves."""
        self._last, self._work = (course, states), Effort(budgets.CERTIFICATE_WORK)
        self._concern(course)
        self._known |= dict.fromkeys(states[1:], True)

    def _concern(self, course: Course) -> None:
        """Discard results of another problem or mission."""
        about = course.problem, course.rounds, course.served, course.sent, course.excused
        if about != self._about:
            self._known.clear()
        self._about = about


def rejoined(
    course: Course, start: JointState, plan: Sequence[JointState]
) -> tuple[JointState, ...] | None:
    """Return the joint states from ``start`` to the end of the mission along ``plan``, a plan for
    the same problem; None if this method finds none."""

    def apart(at: int) -> tuple[int, int]:
        pairs = zip(plan[at].poses, start.poses, strict=True)
        return sum(pose != now for pose, now in pairs), -at

    for at in sorted(range(len(plan)), key=apart)[: budgets.REJOIN_PLACES]:
        if plan[at].stages != start.stages:
            continue
        states = _return(course, start, plan[at].poses)
        if states is not None and _follow(course, states, plan[at:]):
            return tuple(states)
    return None


def _return(course: Course, start: JointState, poses: tuple[int, ...]) -> list[JointState] | None:
    """Return the states on the way to joint poses, with one robot moving after the other."""
    states = [start]
    while states[-1].poses != poses:
        before = len(states)
        for robot, pose in enumerate(poses):
            for step in _way(course, states[-1], robot, pose):
                states.append(course.after(states[-1], robot, step))
                if states[-1].stages != start.stages:
                    return None
        if len(states) == before:
            return None
    return states


def _way(course: Course, state: JointState, robot: int, goal: int) -> list[int]:
    """Return a shortest path of one robot while the others stand still; empty if there is none."""
    graph = course.problem.members[robot].graph
    closed = course.problem.separation.closed(robot, state.poses)
    allowed = course.steps(state.stages)[robot].allowed & ~graph.poses_on(closed)
    return (graph.path(state.poses[robot], goal, allowed) or [])[1:]


def _follow(course: Course, states: list[JointState], plan: Sequence[JointState]) -> bool:
    """Continue along a plan from its first state; return whether that completes the mission."""
    for here, there in pairwise(plan):
        state = states[-1]
        if course.completed(state):
            return True
        if state.stages != here.stages:
            return False
        states.append(course.moved(state, there.poses, range(len(there.poses))))
    return course.completed(states[-1])
