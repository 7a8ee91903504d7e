"""The search for a joint plan from the present state: the sequence of searches and last resorts
(table in ``budgets``)."""

from __future__ import annotations

from collections.abc import Sequence, Set
from functools import partial

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.runtime.resolution.problem import BudgetExhaustedError, Floor
from safenav.runtime.resolution.solve import PoseSets, Solver
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.runtime.traffic import budgets
from safenav.runtime.traffic.continuation_plans import ContinuationPlans
from safenav.runtime.traffic.deadlock import deadlock_of_few, deadlocked
from safenav.runtime.traffic.joint_search.formula_memory import remembering
from safenav.runtime.traffic.joint_search.search import Goal, Search
from safenav.runtime.traffic.joint_search.states import (
    Answer,
    BudgetExhausted,
    Course,
    Effort,
    Exhausted,
    Found,
    JointState,
)
from safenav.runtime.traffic.searches import Searches, SearchProblem
from safenav.scenario.objective import Ltl


class PlanSearch(Struct):
    """Searches for plans. ``starved``: the robot that the plan is for; ``failures``: number of
    consecutive searches that exhausted their budget, ``used``: their effort, ``work``: the effort
    left for the present search; ``spent``: number of all searches that exhausted their budget;
    ``hopeless``: the served obstacles that no plan for the mission resolves, by the last search."""

    state: TeamState
    searches: Searches
    certificates: ContinuationPlans
    in_service: ContinuationPlans
    failures: int = 0
    used: int = 0
    spent: int = 0
    work: Effort = field(default_factory=lambda: Effort(budgets.MOST_WORK))
    starved: str = ""
    hopeless: frozenset[int] = frozenset()
    _cut_off: frozenset[int] = frozenset()
    _leg_end: int = 0

    @property
    def hindered(self) -> bool:
        """Return whether a robot out of service shares its floor, and plans are for the whole
        mission."""
        out = not self.searches.sharing.isdisjoint(self.state.out_of_service)
        return out and self.searches.turning

    def search_of(self, problem: SearchProblem, goal: Goal | None = None) -> Search:
        """Return a search limited by the remaining work."""
        return self.searches.search(problem, goal, work=self.work)

    @property
    def helping(self) -> bool:
        """Return whether a robot helps: then plans end with a resolution."""
        return any(r.assignment.role is Role.HELPS for r in self.state.robots.values())

    def sought(self, plain: Floor, floor: Floor) -> tuple[SearchProblem, Answer]:
        """Search for a plan, including the last resorts; return it with the problem that gives its
        start. Raises RunEnded as ``_check_small_groups``."""
        self.work = Effort(budgets.MOST_WORK - self.used)
        problem = self.searches.problem(floor)
        if self.state.live and problem.start.stages != floor.stages:
            return problem, BudgetExhausted()  # a robot is about to resolve an obstacle
        problem, search, answer = self._searched(problem)
        if (isinstance(answer, Exhausted) or self.hopeless) and floor is not plain:
            if remembering(floor.problem):
                if isinstance(answer, Exhausted) and (proof := self._proof(plain)) is not None:
                    return proof
                self.searches.give_up(plain)
            # there are paths besides those of the strategies
            problem, search, answer = self._searched(self.searches.problem(plain))
        exhausted, floor = isinstance(answer, Exhausted), problem.floor
        if (exhausted or self.hopeless) and any(m.any_first for m in floor.problem.members):
            tried = [problem.course] if exhausted else []
            for rules in (self.searches.course(floor), *tried):
                other = self.searches.problem(floor, replace(rules, any_first=True))
                search = self.search_of(other)
                found = search.run(1)
                if exhausted or isinstance(found, Found):
                    problem, answer = other, found
                if isinstance(found, Found):
                    self.hopeless = frozenset()
                    break
        if isinstance(answer, BudgetExhausted):
            self._check_small_groups(plain, problem.course)
        if isinstance(answer, Found):
            answer = self._repeatable(problem, answer)
            answer = self._left_well(problem, answer)
        return problem, answer

    def _repeatable(self, problem: SearchProblem, found: Found) -> Found:
        """Return a plan at whose end the rounds can restart, as they do if a robot resolves an
        undiscovered obstacle in passing: then they can restart from each state of the plan. Return
        the plan that was found if it has this property, or no other plan is found."""
        if not self.searches.turning or self._can_restart(problem, found.states[-1]):
            return found

        def goal(state: JointState) -> bool:
            return problem.course.completed(state) and self._can_restart(problem, state)

        answer = self.search_of(problem, goal).run(*budgets.CERTIFICATE)
        return answer if isinstance(answer, Found) else found

    def _can_restart(self, problem: SearchProblem, state: JointState) -> bool:
        """Return whether the rounds may be able to restart in a state: no search refutes it."""
        counts = tuple((index, 0, 0) for index, _, _ in state.counts)
        begun = problem.course.begun(state.poses, counts, state.stages)
        return not self.search_of(problem.at(begun)).refuted()

    def _proof(self, plain: Floor) -> tuple[SearchProblem, Answer] | None:
        """Return the problem and proof that no order of moves completes the mission with the
        robots' formula memory; None without such a proof."""
        floor = self.searches.everything(plain)
        if floor is None:
            return None
        course = Course(floor.problem, self.state.scenario.until.rounds, any_first=True)
        problem = self.searches.problem(floor, course)
        answer = self.search_of(problem).singles(budgets.PROOF_BUDGET)
        return (problem, answer) if isinstance(answer, Exhausted) else None

    def _left_well(self, problem: SearchProblem, found: Found) -> Found:
        """Return a plan for which each robot's charge suffices, and at whose end each may stay or
        return to service: the plan that was found, if it has these properties or no other has."""
        charged = self.searches.charged(problem)
        begun, has_charge = charged.start, charged.course.has_charge
        stays = self.searches.stays(problem.floor)

        def ends_well(state: JointState, done: Goal = lambda _: True) -> bool:
            stay = done(state) and all(m >> state.poses[i] & 1 for i, m in stays.items())
            return stay and self.in_service.ends_well(problem, state)

        cut = self.cut(problem, found.states)
        states = charged.course.along(begun, (state.poses for state in cut[1:]))
        if ends_well(states[-1]) and all(map(has_charge, states)):
            return found
        done = partial(self.leg_done, charged)
        there = partial(self.starving_is_there, charged)
        for rounds, goal in ((1, done), (budgets.ROUNDS_FIRST, there)):
            search = self.search_of(charged, partial(ends_well, done=goal))
            search.keeps = lambda s: has_charge(s) and (s.stages == begun.stages or ends_well(s))
            leg = search.run(rounds)
            if isinstance(leg, Found):
                leg = Found(tuple(replace(state, charges=()) for state in leg.states))
                whole = self._leg_first(problem, leg) if self.searches.turning else leg
                if whole is not None:
                    return whole
        return found

    def _leg_first(self, problem: SearchProblem, leg: Answer) -> Found | None:
        """Return a plan that begins with a leg and continues through the whole mission; None if
        none is found soon."""
        whole = self.continued(problem, leg.states) if isinstance(leg, Found) else None
        if isinstance(leg, Found) and whole is not None:
            self._leg_end = len(leg.states)
        return whole

    def continued(self, problem: SearchProblem, states: Sequence[JointState]) -> Found | None:
        """Return moves followed by a plan for the rest of the mission; None if none is found."""
        own = self.searches.own_of_charging()
        rest = self.search_of(replace(problem, start=states[-1], goals=own)).run(1)
        return Found((*states, *rest.states[1:])) if isinstance(rest, Found) else None

    def leg(self, problem: SearchProblem) -> list[JointState] | None:
        """Return moves that bring at least the starving robot to its target: because of formula
        memory a plan for all may assume goals met that are not. None if there are no such moves, or
        the team could not continue after them."""
        answer, robot = self._leg_of_starved(problem), self.state.robots[self.starved]
        if isinstance(answer, Exhausted):
            if self.charges(robot):  # another stop may suffice
                hemmed_in = self.state.last_settled.notes.hemmed_in
                hemmed_in[problem.floor.index(self.starved)] = robot.pose
            elif self.state.out_of_service:
                self._only_out_hinder(problem.floor)
        if not isinstance(answer, Found):
            return None
        last = self.searches.turning and self.continued(problem, answer.states) is None
        return None if last else list(answer.states)

    def _only_out_hinder(self, floor: Floor) -> None:
        """Record that no order of moves brings the starving robot to its target while some robots
        are out of service: other requests may be served without its obstacle."""
        assignment = (robot := self.state.robots[self.starved]).assignment
        if assignment.role is Role.OWN:
            self.state.last_settled.notes.hemmed_in[floor.index(self.starved)] = robot.pose
        elif assignment.role is Role.HELPS and assignment.obstacle in floor.gates:
            self.hopeless = self._with_those_after({floor.gates.index(assignment.obstacle)})

    def _with_those_after(self, gates: Set[int]) -> frozenset[int]:
        """Return these obstacles with all served ones that cannot be resolved without them: they
        block the path, or are loads that a robot carries."""
        floor, hopeless, resolved = self.searches.floor(), {*gates}, frozenset[int]()
        everybody = frozenset(range(len(floor.names)))
        left = [
            replace(g, refused=everybody) if k in gates else g
            for k, g in enumerate(floor.problem.gates)
        ]
        solver = Solver(replace(floor.problem, gates=tuple(left)), self.searches.check)
        now = PoseSets.around(solver.problem, floor.poses, floor.stages)
        try:
            served = self.state.last_settled.found.served if solver.feasible(now) else ()
            for gate in served:
                if gate not in gates and solver.feasible(now, resolved | {gate}):
                    resolved |= {gate}
                else:
                    hopeless.add(gate)
        except BudgetExhaustedError:
            pass  # another search may succeed
        return frozenset(hopeless)

    def _leg_of_starved(self, problem: SearchProblem) -> Answer:
        """Search for moves that bring the starving robot to its target."""
        floor = problem.floor
        goals = {floor.index(self.starved): self.searches.goal(floor, self.starved)}

        def goal(state: JointState) -> bool:
            there = self.starving_is_there(problem, state)
            return there and self.in_service.ends_well(problem, state)

        return self.search_of(replace(problem, goals=goals), goal).run(1)

    def starving_is_there(self, problem: SearchProblem, state: JointState) -> bool:
        """Return whether the starving robot has reached its target, or resolved its obstacle (any,
        if it is sent to none)."""
        floor, start = problem.floor, problem.start
        index, goal = floor.index(self.starved), self.searches.goal(floor, self.starved)
        obstacle = self.state.robots[self.starved].assignment.obstacle
        some = (
            [floor.gates.index(obstacle)] if obstacle in floor.gates else range(len(start.stages))
        )
        changed = any(state.stages[k] != start.stages[k] for k in some)
        return changed or bool(goal >> state.poses[index] & 1)

    def cut(self, problem: SearchProblem, states: Sequence[JointState]) -> list[JointState]:
        """Return the plan up to the first resolution or, if it is not followed through the mission,
        until each robot has counted a goal."""
        found, through = [], self._through_the_mission()
        for state in states:
            found.append(state)
            resolved = state.stages != problem.start.stages
            done = resolved if through else self.leg_done(problem, state)
            if len(found) == self._leg_end or done:
                break
        return found

    def _through_the_mission(self) -> bool:
        """Live: return whether the robots follow the whole plan, since on a narrow floor they would
        soon starve again. Not with helpers, robots out of service, batteries or formulas: these
        may invalidate the rest of the plan."""
        return self.state.live and all(
            robot.active
            and robot.assignment.role is Role.OWN
            and robot.robot.model.battery is None
            and not isinstance(robot.own.objective, Ltl)
            for robot in self.state.robots.values()
        )

    def leg_done(self, problem: SearchProblem, state: JointState) -> bool:
        """Return whether a plan may end in a state: after a resolution or, if no robot helps, when
        each robot has counted a goal."""
        resolved = state.stages != problem.start.stages
        return resolved or (not self.helping and self._each_has_counted(problem, state))

    def charges(self, robot: RobotState) -> bool:
        """Return whether this is the starving robot, on its way to a charger."""
        starves = robot.name == self.starved and robot.active
        return starves and robot.assignment.role is Role.CHARGES

    def _each_has_counted(self, problem: SearchProblem, state: JointState) -> bool:
        """Return whether each robot with goal poses has reached them once; among those that go to a
        charger, only the starving one counts. If that completes all rounds, the robots whose
        objective ends must stand at their last targets."""
        course, before, owners = problem.course, problem.start.counts, list[int]()
        for index, robot in enumerate(self.state.robots.values()):
            if self.charges(robot) and not self.starving_is_there(problem, state):
                return False
            if robot.active and robot.assignment.role is Role.OWN and index not in self._cut_off:
                owners.append(index)
        counted = (state.counts[i] != before[i] or course.is_done(i, before[i]) for i in owners)
        if not all(counted):
            return False
        if not all(course.is_done(i, state.counts[i]) for i in owners):
            return True
        return all(course.stands(i, state.poses[i]) for i in owners)

    def _searched(self, problem: SearchProblem) -> tuple[SearchProblem, Search, Answer]:
        """Search for a plan; return the search and its result."""
        self.hopeless, floor = frozenset(), problem.floor
        self._cut_off, self._leg_end = self.searches.cut_off(floor), 0
        turning, search = self.searches.turning, self.search_of(problem)
        if turning or remembering(floor.problem):
            hindered = self.hindered
            answer = search.run(1, chain=budgets.CERTIFICATE_CHAIN) if hindered else search.run(1)
            if isinstance(answer, BudgetExhausted):
                answer = self.certificates.again(problem.course, problem.start) or answer
            charging = turning and self.searches.own_of_charging()
            if isinstance(answer, BudgetExhausted) and charging:
                answer = self._leg_first(problem, self._leg_of_starved(problem)) or answer
            if isinstance(answer, BudgetExhausted) and turning and not hindered:
                answer = search.run(self._rounds)
            if isinstance(answer, Exhausted) and problem.course.served:
                problem, search, answer = self._without_hopeless(problem)
            if turning or not isinstance(answer, BudgetExhausted):
                return problem, search, answer
        # All moves can be undone, so a plan for the present goals alone is safe.
        search.goal = partial(self.leg_done, problem)
        answer = search.run(self._rounds, 0)
        if isinstance(answer, Found) and self._through_the_mission():
            answer = self._with_further_legs(problem, answer)
        if isinstance(answer, Exhausted):
            aside, sent = self.state.requests.aside, problem.course.sent.values()
            sent_to = frozenset(g for g in sent if floor.gates[g] not in aside)
            self.hopeless = problem.course.served
            if sent_to:  # other requests may be served without these
                self.hopeless = self._with_those_after(sent_to)
            problem = replace(problem, course=problem.course.serving(frozenset()))
            search.goal = problem.course.completed
            answer = search.run(budgets.ROUNDS_FIRST)
        return problem, search, answer

    def _with_further_legs(self, problem: SearchProblem, found: Found) -> Found:
        """Return a plan on which each robot counts a goal once, with further legs as long as these
        are easily found."""
        states = list(found.states)
        while not problem.course.completed(here := states[-1]) and here.stages == states[0].stages:
            leg = problem.at(here)
            answer = self.search_of(leg, partial(self.leg_done, leg)).run(1, 0)
            if not isinstance(answer, Found) or len(answer.states) == 1:
                break
            states += answer.states[1:]
        return Found(tuple(states))

    def turned(self, problem: SearchProblem, states: Sequence[JointState]) -> dict[str, int]:
        """Return the robots that in a plan, up to its first resolution, begin with another target
        than their next one, each with the number of that target."""
        found, floor = dict[str, int](), problem.floor
        if not problem.course.any_first:
            return found
        before = self.searches.counts(floor)
        for state in states:
            if state.stages != states[0].stages:
                break
            for index, (name, count) in enumerate(zip(floor.names, state.counts, strict=True)):
                member = floor.problem.members[index]
                if not member.any_first or before[index][2] or not count[2] or name in found:
                    continue
                found[name] = (count[0] - count[2]) % len(member.targets)
        return {n: k for n, k in found.items() if k != before[floor.index(n)][0]}

    def _without_hopeless(self, problem: SearchProblem) -> tuple[SearchProblem, Search, Answer]:
        """Search for a plan for the mission if none resolves all served obstacles: for as many
        obstacles as possible, in the order in which they are served."""

        def serving(gates: frozenset[int]) -> tuple[SearchProblem, Search, Answer]:
            less = replace(problem, course=problem.course.serving(gates))
            search = self.search_of(less)
            return less, search, search.run(1)

        found = serving(frozenset())
        wanted = self.state.last_settled.found.served if isinstance(found[-1], Found) else ()
        for gate in wanted:
            more = serving(found[0].course.served | {gate})
            if isinstance(more[-1], Found):
                found = more
            elif isinstance(more[-1], Exhausted):
                self.hopeless |= {gate}
        return found

    @property
    def _rounds(self) -> int:
        """Return the rounds of the next search. After some further moves the search is often
        easier, so each effort is made four times before a larger one."""
        return budgets.ROUNDS_FIRST + self.failures // 4

    def _check_small_groups(self, floor: Floor, course: Course) -> None:
        """Check whether a few of the robots can never complete: after a search has first exhausted
        its budget, and occasionally later. Raises RunEnded with the proof."""
        self.spent += 1
        if self.spent not in budgets.LOOKS_FOR_FEW:
            return
        counts = self.searches.counts(floor)
        active = [i for i, robot in enumerate(self.state.robots.values()) if robot.active]
        few = deadlock_of_few(floor, active, course.rounds, counts, self.searches.check, self.work)
        if few is not None:
            raise deadlocked(self.state, *few)
