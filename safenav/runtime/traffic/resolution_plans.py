"""Plans that lead to a resolution: the approach of waiting robots."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from safenav.runtime.resolution.problem import Floor
from safenav.runtime.team import Role, TeamState
from safenav.runtime.traffic import budgets
from safenav.runtime.traffic.joint_search.execution import schedule
from safenav.runtime.traffic.joint_search.formula_memory import remembering
from safenav.runtime.traffic.joint_search.shortening import following, shortened, timed
from safenav.runtime.traffic.joint_search.states import Found, JointState
from safenav.runtime.traffic.plan_search import PlanSearch
from safenav.runtime.traffic.searches import Searches, SearchProblem


class ResolutionPlans(Struct):
    """Plans for helpers, and for the robots that wait for them."""

    state: TeamState
    searches: Searches
    search: PlanSearch

    def approached(self, floor: Floor, states: Sequence[JointState]) -> Sequence[JointState]:
        """Return a plan that ends with a resolution, on which waiting robots approach their targets
        behind the others, if that shortens the next plan."""
        problem, first, last = floor.problem, states[0], states[-1]
        if last.stages == first.stages or remembering(problem):
            return states
        beyond = self.searches.problem(floor).at(last)
        course, found = beyond.course, list(states)
        for index, robot in enumerate(self.state.robots.values()):
            waits = robot.active and robot.assignment.role is Role.WAITS
            if waits and not problem.members[index].turns and problem.conflicts[index]:
                found = following(course, found, index) or found
        if found[-1].poses == last.poses:
            return states
        after = self._next_leg(beyond.at(found[-1]))
        before = self._next_leg(beyond)
        if after is None or (before is not None and before <= after):
            return states
        if self.searches.turning:
            rest = self.search.search_of(beyond.at(found[-1])).run(*budgets.CERTIFICATE)
            if not isinstance(rest, Found):
                return states
            self.search.certificates.keep(course, (*found, *rest.states[1:]))
        return found

    def _next_leg(self, problem: SearchProblem) -> int | None:
        """Return the ticks until each robot has counted a goal after a resolution, or another
        resolution occurs; None if that is not found soon."""
        course, start = problem.course, problem.start

        def goal(state: JointState) -> bool:
            return state.stages != start.stages or all(
                course.is_done(i, count) or state.counts[i] != count
                for i, count in enumerate(start.counts)
            )

        search = self.search.search_of(problem, goal)
        answer = search.run(*budgets.CERTIFICATE)
        if not isinstance(answer, Found):
            return None
        states = shortened(course, answer.states, (), search.stopping)
        apart = problem.floor.problem.separation
        return len(timed(schedule(apart, [state.poses for state in states])))
