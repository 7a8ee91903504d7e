"""The quickest plans that lead to a resolution."""

from __future__ import annotations

from collections.abc import Sequence

from msgspec import Struct

from safenav.runtime.resolution.problem import Floor
from safenav.runtime.team import TeamState
from safenav.runtime.traffic import budgets
from safenav.runtime.traffic.joint_search.formula_memory import remembering
from safenav.runtime.traffic.joint_search.states import Effort, Found, JointState
from safenav.runtime.traffic.joint_search.timed import Quickest, beside, keeping_out
from safenav.runtime.traffic.plan_search import PlanSearch
from safenav.runtime.traffic.searches import Searches, SearchProblem


class ResolutionPlans(Struct):
    """Plans for helpers."""

    state: TeamState
    searches: Searches
    search: PlanSearch

    def quickest(
        self, floor: Floor, gate: int, known: Floor | None = None
    ) -> list[JointState] | None:
        """Return the quickest plan for the next need of an obstacle, if the team can continue after
        it. ``known``: the floor on which it must continue, if different."""
        if remembering(self.searches.aimed(floor).problem):
            return None
        check = self.searches.check
        found = Quickest(floor.problem, floor.stages, floor.poses, gate, check).plan()
        if found is None:
            return None
        goals = [self.searches.goal(floor, name) for name in floor.names]
        first, *rest = beside(floor, found, goals)
        problem = self.searches.problem(floor, poses=first)
        course = problem.course
        states = course.along(problem.start, rest)
        if self.searches.turning:
            if known is not None:
                problem = SearchProblem(known, self.searches.course(known), problem.start)
            work = Effort(budgets.MOST_WORK - self.search.used)
            after = self.searches.search(problem.at(states[-1]), work=work).run(1)
            if not isinstance(after, Found):
                return None
            self.search.certificates.keep(course, (*states, *after.states[1:]))
        return states

    def around_suspects(
        self, floor: Floor, gate: int, hopeful: Sequence[JointState] | None
    ) -> tuple[Floor, list[JointState]] | None:
        """Return the quickest plan around all suspected obstacles, if it is in time and the
        ``hopeful`` plan enters their regions: no discovery interrupts it (docs/deadlines.md)."""
        chosen, dues = self.state.last_settled.in_time, self.state.dues(floor)
        if chosen is None or dues is None or not any(dues.suspected):
            return None
        sizes = [member.graph.size for member in floor.problem.members]
        if hopeful is not None and not any(
            pose != here and shut >> pose % size & 1
            for state in hopeful
            for pose, here, shut, size in zip(
                state.poses, floor.poses, dues.suspected, sizes, strict=True
            )
        ):
            return None
        around = keeping_out(floor, dues.suspected)
        states = self.quickest(around, gate, floor)
        need, tick = floor.stages[gate].need, self.state.tick - 1 + len(states or ())
        if states is None or not chosen.keeps(gate, need, tick, dues):
            return None
        return around, states
