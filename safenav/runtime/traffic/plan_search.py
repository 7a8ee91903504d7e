"""The search for a joint plan from where the team stands: what is searched for in which order, with
the last resorts (the table in ``budgets``)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import pairwise

from msgspec import Struct, field
from msgspec.structs import replace

from safenav.runtime.resolution.problem import Floor
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.runtime.traffic import budgets
from safenav.runtime.traffic.background_search import BackgroundSearch
from safenav.runtime.traffic.continuation_plans import ContinuationPlans
from safenav.runtime.traffic.deadlock import deadlock_of_few, deadlocked
from safenav.runtime.traffic.formula_memory import plain_poses, remembering
from safenav.runtime.traffic.joint import (
    Answer,
    BudgetExhausted,
    Course,
    Effort,
    Exhausted,
    Found,
    JointState,
)
from safenav.runtime.traffic.joint_plan import Search
from safenav.runtime.traffic.local import local_plan
from safenav.runtime.traffic.searches import Searches
from safenav.runtime.traffic.shortening import Separation, following, shortened, timed
from safenav.runtime.traffic.timed import Quickest, beside
from safenav.scenario.objective import Ltl


class PlanSearch(Struct):
    """Searches for plans. ``rivals``: whether a robot shares its floor; ``starved``: the robot that
    the plan is for; ``failures``: searches in a row with an exhausted budget, ``used``: their work,
    ``work``: the rest for the present one; ``spent``: all such searches; ``hopeless``: the
    served obstacles that no plan for the mission resolves, as the last one has shown."""

    state: TeamState
    thinking: BackgroundSearch
    searches: Searches
    certificates: ContinuationPlans
    rivals: Mapping[str, bool]
    failures: int = 0
    used: int = 0
    spent: int = 0
    work: Effort = field(default_factory=lambda: Effort(budgets.MOST_WORK))
    starved: str = ""
    hopeless: frozenset[int] = frozenset()
    _cut_off: frozenset[int] = frozenset()
    _leg_end: int = 0

    @property
    def turning(self) -> bool:
        """Whether a robot with headings shares its floor."""
        problem = self.state.last_settled.floor.problem
        return any(m.turns and problem.interferes(i) for i, m in enumerate(problem.members))

    @property
    def hindered(self) -> bool:
        """Whether a robot out of service shares its floor, and plans are for the whole mission."""
        out = any(self.rivals[name] for name in self.state.out_of_service)
        return out and self.turning

    def sought(
        self, plain: Floor, floor: Floor, helping: bool
    ) -> tuple[Floor, Course, JointState, Answer]:
        """Search for a plan, the last resorts included; return also where it begins. Raises
        RunEnded as ``_look_for_few``."""
        self.work = Effort(budgets.MOST_WORK - self.used)
        course = self.searches.course(floor)
        start = self.searches.begun(floor, course)
        if self.state.live and start.stages != floor.stages:
            return floor, course, start, BudgetExhausted(0)  # a robot is about to resolve something
        course, start, search, answer = self._searched(floor, helping)
        if (isinstance(answer, Exhausted) or self.hopeless) and floor is not plain:
            if remembering(floor.problem):
                if isinstance(answer, Exhausted) and (proof := self._proof(plain)) is not None:
                    return proof
                self.searches.give_up(plain)
            floor = plain  # the strategies' own ways are not all that there are
            course, start, search, answer = self._searched(floor, helping)
        exhausted = isinstance(answer, Exhausted)
        if (exhausted or self.hopeless) and any(m.any_first for m in floor.problem.members):
            for rules in (self.searches.course(floor), *([course] if exhausted else ())):
                other = replace(rules, any_first=True)
                begun = self.searches.begun(floor, other)
                search = self.searches.search(floor, other, begun, work=self.work)
                found = search.run(1)
                if isinstance(found, Found) and rules is not course:
                    self.hopeless = frozenset()
                if exhausted or isinstance(found, Found):
                    course, start, answer = other, begun, found
                if isinstance(found, Found):
                    break
        if isinstance(answer, BudgetExhausted):
            self._look_for_few(plain, course)
            answer = (None if self.turning else local_plan(search)) or answer
        if isinstance(answer, Found):
            answer = self._repeatable(floor, course, start, answer)
            answer = self._left_well(floor, course, start, answer, helping)
        return floor, course, start, answer

    def _repeatable(self, floor: Floor, course: Course, start: JointState, found: Found) -> Found:
        """A plan at whose end the rounds can restart, as they do if a robot on its way resolves an
        obstacle that no robot knew: then they can from each state of the plan. The one that was
        found, if it is so or no other one is found."""
        if not self.turning or self._can_restart(floor, course, found.states[-1]):
            return found
        search = self.searches.search(floor, course, start, work=self.work)
        search.goal = lambda state: (
            course.completed(state) and self._can_restart(floor, course, state)
        )
        answer = search.run(*budgets.CERTIFICATE)
        return answer if isinstance(answer, Found) else found

    def _can_restart(self, floor: Floor, course: Course, state: JointState) -> bool:
        """Whether no search has shown that the rounds cannot restart in a state."""
        counts = tuple((index, 0, 0) for index, _, _ in state.counts)
        begun = course.begun(state.poses, counts, state.stages)
        return not self.searches.search(floor, course, begun, work=self.work).refuted()

    def _proof(self, plain: Floor) -> tuple[Floor, Course, JointState, Answer] | None:
        """The search that proves that no order of moves completes the mission with what the
        robots' formulas remember; None if one may."""
        floor = self.searches.everything(plain)
        if floor is None:
            return None
        course = Course(floor.problem, self.state.scenario.until.rounds, any_first=True)
        start = self.searches.begun(floor, course)
        search = self.searches.search(floor, course, start, work=self.work)
        answer = search.singles(budgets.PROOF_BUDGET)
        return (floor, course, start, answer) if isinstance(answer, Exhausted) else None

    def _left_well(
        self, floor: Floor, course: Course, start: JointState, found: Found, helping: bool
    ) -> Found:
        """A plan that takes no more charge of a robot than it has, and at whose end each may stay,
        if that is not so for the one that was found and another one is found; else that one."""
        charged, begun = self.searches.charged(floor, course, start)
        stays = self.searches.stays(floor)

        def ends_well(state: JointState) -> bool:
            return all(mask >> state.poses[robot] & 1 for robot, mask in stays.items())

        cut = self.cut(course, start, found.states, helping)
        states = charged.along(begun, (state.poses for state in cut[1:]))
        if ends_well(states[-1]) and all(map(charged.lasts, states)):
            return found
        search = self.searches.search(floor, charged, begun, work=self.work)
        search.goal = lambda state: (
            self.leg_done(charged, begun, state, helping) and ends_well(state)
        )
        search.keeps = lambda state: (
            charged.lasts(state) and (state.stages == begun.stages or ends_well(state))
        )
        leg = search.run(budgets.ROUNDS_FIRST)
        if not isinstance(leg, Found):
            return found
        states = [replace(state, charges=()) for state in leg.states]
        if not self.turning:
            self._leg_end = 0
            return Found(tuple(states))
        whole = self._continued(floor, course, states)
        if whole is None:
            return found
        self._leg_end = len(states)
        return whole

    def _continued(
        self, floor: Floor, course: Course, states: Sequence[JointState]
    ) -> Found | None:
        """Moves, and a plan for the rest of the mission after them; None if none is found soon."""
        own = self.searches.own_of_charging()
        rest = self.searches.search(floor, course, states[-1], own, work=self.work).run(1)
        return Found((*states, *rest.states[1:])) if isinstance(rest, Found) else None

    def quickest(
        self, floor: Floor, gate: int, known: Floor | None = None
    ) -> list[JointState] | None:
        """The quickest plan for the next need of an obstacle, if the team can continue then.
        ``known``: the floor on which it is to continue, if that is another one."""
        if remembering(self.searches.aimed(floor).problem):
            return None
        check = self.thinking.check
        found = Quickest(floor.problem, floor.stages, floor.poses, gate, check).plan()
        if found is None:
            return None
        goals = [self.searches.goal(floor, name) for name in floor.names]
        first, *rest = beside(floor, found, goals)
        course = self.searches.course(floor)
        states = course.along(self.searches.begun(floor, course, first), rest)
        if self.turning:
            rules, work = (
                self.searches.course(known or floor),
                Effort(budgets.MOST_WORK - self.used),
            )
            after = self.searches.search(known or floor, rules, states[-1], work=work).run(1)
            if not isinstance(after, Found):
                return None
            self.certificates.keep(course, (*states, *after.states[1:]))
        return states

    def straightened(self, floor: Floor, states: list[JointState]) -> list[JointState]:
        """A plan on which a robot steps more often than it has poses (two that must stand in
        different places drive each other round and round), or the quickest one instead of it."""
        robot = self.state.robots[self.starved]
        ways = zip(*(state.poses for state in states), strict=True)
        graphs = (member.graph for member in floor.problem.members)
        turns = any(
            sum(a != b for a, b in pairwise(way)) > graph.everywhere.bit_count()
            for way, graph in zip(ways, graphs, strict=True)
        )
        obstacle = robot.assignment.obstacle
        if not turns or robot.assignment.role is not Role.HELPS or obstacle not in floor.gates:
            return states
        found = self.quickest(floor, floor.gates.index(obstacle))
        return states if found is None or len(found) >= len(states) else found

    def approached(self, floor: Floor, states: Sequence[JointState]) -> Sequence[JointState]:
        """A plan that ends with a resolution, on which robots that wait come nearer to their
        targets behind the others, if that makes the next plan shorter."""
        problem, first, last = floor.problem, states[0], states[-1]
        if last.stages == first.stages or remembering(problem):
            return states
        course, found = self.searches.course(floor), list(states)
        for index, robot in enumerate(self.state.robots.values()):
            waits = robot.active and robot.assignment.role is Role.WAITS
            if waits and not problem.members[index].turns and problem.conflicts[index]:
                found = following(course, found, index) or found
        if found[-1].poses == last.poses:
            return states
        after = self._next_leg(floor, course, found[-1])
        before = self._next_leg(floor, course, last)
        if after is None or (before is not None and before <= after):
            return states
        if self.turning:
            search = self.searches.search(floor, course, found[-1], work=self.work)
            rest = search.run(*budgets.CERTIFICATE)
            if not isinstance(rest, Found):
                return states
            self.certificates.keep(course, (*found, *rest.states[1:]))
        return found

    def _next_leg(self, floor: Floor, course: Course, start: JointState) -> int | None:
        """The ticks until each robot has counted once after a resolution, or there is another one;
        None if that is not found soon."""
        search = self.searches.search(floor, course, start, work=self.work)
        search.goal = lambda state: (
            state.stages != start.stages
            or all(
                course.is_done(i, count) or state.counts[i] != count
                for i, count in enumerate(start.counts)
            )
        )
        answer = search.run(*budgets.CERTIFICATE)
        if not isinstance(answer, Found):
            return None
        states = shortened(course, answer.states, (), search.stopping)
        apart = Separation.of(floor.problem, start.stages)
        return len(timed(apart.schedule([state.poses for state in states])))

    def leg(self, floor: Floor, course: Course, start: JointState) -> list[JointState] | None:
        """Return moves that bring at least the starving robot to its target: formulas may
        remember, so that a plan for all assumes goals as met that are not. None if there are no
        such moves, or the team could not continue after them."""
        answer = self._leg_of_starved(floor, course, start)
        if isinstance(answer, Exhausted):
            if self.charges(self.state.robots[self.starved]):  # another stop may do
                self.state.last_settled.notes.hemmed_in |= {floor.index(self.starved)}
            elif self.state.out_of_service:
                self._only_out_hinder(floor)
        if not isinstance(answer, Found):
            return None
        if self.turning and self._continued(floor, course, answer.states) is None:
            return None
        return list(answer.states)

    def _only_out_hinder(self, floor: Floor) -> None:
        """No order of moves brings the starving robot to its target while some are out of service:
        others may be served without the obstacle that it is to resolve."""
        assignment = self.state.robots[self.starved].assignment
        if assignment.role is Role.OWN:
            self.state.last_settled.notes.hemmed_in |= {floor.index(self.starved)}
        elif assignment.role is Role.HELPS and assignment.obstacle in floor.gates:
            self.hopeless = frozenset({floor.gates.index(assignment.obstacle)})

    def _leg_of_starved(self, floor: Floor, course: Course, start: JointState) -> Answer:
        """Search for moves that bring the starving robot to its target."""
        index, goal = floor.index(self.starved), self.searches.goal(floor, self.starved)
        obstacle = self.state.robots[self.starved].assignment.obstacle
        gate = floor.gates.index(obstacle) if obstacle in floor.gates else None

        def changed(state: JointState) -> bool:
            if gate is None:
                return state.stages != start.stages
            return state.stages[gate] != start.stages[gate]

        search = self.searches.search(floor, course, start, {index: goal}, work=self.work)
        search.goal = lambda state: changed(state) or bool(goal >> state.poses[index] & 1)
        return search.run(1)

    def _leg_first(self, floor: Floor, course: Course, start: JointState) -> Found | None:
        """Return a plan that brings the starving robot to its target while others go to their
        chargers and stay there, and then all through the mission. None if none is found."""
        leg = self._leg_of_starved(floor, course, start)
        whole = self._continued(floor, course, leg.states) if isinstance(leg, Found) else None
        if isinstance(leg, Found) and whole is not None:
            self._leg_end = len(leg.states)
        return whole

    def cut(
        self, course: Course, start: JointState, states: Sequence[JointState], helping: bool
    ) -> list[JointState]:
        """The plan up to the first resolution; where it does not lead through the mission, until
        each has counted once."""
        found, through = [], self._through_the_mission(helping)
        for state in states:
            found.append(state)
            resolved = state.stages != start.stages
            done = resolved if through else self.leg_done(course, start, state, helping)
            if len(found) == self._leg_end or done:
                break
        return found

    def _through_the_mission(self, helping: bool) -> bool:
        """Live: whether all of a plan is followed. It delays only those that wait for others by its
        order, and where robots share a narrow floor they would soon starve again. Helpers, robots
        out of service, batteries and inputs of formulas change what comes next."""
        return (
            self.state.live
            and not helping
            and all(
                robot.active
                and robot.assignment.role is Role.OWN
                and robot.robot.model.battery is None
                and not isinstance(robot.own.objective, Ltl)
                for robot in self.state.robots.values()
            )
        )

    def leg_done(self, course: Course, start: JointState, state: JointState, helping: bool) -> bool:
        if state.stages != start.stages:
            return True
        return not helping and self._each_has_counted(course, start, state)

    def charges(self, robot: RobotState) -> bool:
        """Whether it is the robot that starves, on its way to a charger."""
        starves = robot.name == self.starved and robot.active
        return starves and robot.assignment.role is Role.CHARGES

    def _each_has_counted(self, course: Course, start: JointState, state: JointState) -> bool:
        """Whether each robot with goal poses has reached them once; of those that go to a charger
        only the one that starves."""
        for index, robot in enumerate(self.state.robots.values()):
            if self.charges(robot) and not self._at_stop(course, state, index, robot):
                return False
            if robot.assignment.role is not Role.OWN or not robot.active:
                continue
            if course.is_done(index, start.counts[index]) or index in self._cut_off:
                continue
            if state.counts[index] == start.counts[index]:
                return False
        return True

    def _at_stop(self, course: Course, state: JointState, index: int, robot: RobotState) -> bool:
        pose = plain_poses(course.problem, state.poses)[index]
        return bool(robot.assignment.goal >> pose & 1)

    def _searched(self, floor: Floor, helping: bool) -> tuple[Course, JointState, Search, Answer]:
        """Search for a plan; return the search and its result."""
        self.hopeless = frozenset()
        self._cut_off, self._leg_end = self.searches.cut_off(floor), 0
        course = self.searches.course(floor)
        start = self.searches.begun(floor, course)
        search = self.searches.search(floor, course, start, work=self.work)
        if self.turning or remembering(floor.problem):
            hindered = self.hindered
            answer = search.run(1, chain=budgets.CERTIFICATE_CHAIN) if hindered else search.run(1)
            if isinstance(answer, BudgetExhausted):
                answer = self.certificates.again(course, start) or answer
            if (
                isinstance(answer, BudgetExhausted)
                and self.turning
                and self.searches.own_of_charging()
            ):
                answer = self._leg_first(floor, course, start) or answer
            if isinstance(answer, BudgetExhausted) and self.turning and not hindered:
                answer = search.run(self._rounds)
            if isinstance(answer, Exhausted) and course.served:
                course, search, answer = self._without_hopeless(floor, course, start)
            if self.turning or not isinstance(answer, BudgetExhausted):
                return course, start, search, answer
        # Everything can be undone: a plan that serves those that want something is safe.
        search.goal = lambda state: self.leg_done(course, start, state, helping)
        answer = search.run(self._rounds, 0)
        if isinstance(answer, Found) and self._through_the_mission(helping):
            answer = self._with_further_legs(floor, course, answer)
        if isinstance(answer, Exhausted):
            aside = self.state.requests.aside
            sent = frozenset(g for g in course.sent.values() if floor.gates[g] not in aside)
            self.hopeless = sent or course.served  # others may be served without those
            course = course.serving(frozenset())
            search.goal = course.completed
            answer = search.run(budgets.ROUNDS_FIRST)
        return course, start, search, answer

    def _with_further_legs(self, floor: Floor, course: Course, found: Found) -> Found:
        """A plan on which each robot counts once, continued as far as that is easily found."""
        states = list(found.states)
        while not course.completed(here := states[-1]) and here.stages == states[0].stages:
            search = self.searches.search(floor, course, here, work=self.work)
            search.goal = partial(self.leg_done, course, here, helping=False)
            answer = search.run(1, 0)
            if not isinstance(answer, Found) or len(answer.states) == 1:
                break
            states += answer.states[1:]
        return Found(tuple(states))

    def turned(self, floor: Floor, course: Course, states: Sequence[JointState]) -> dict[str, int]:
        """The robots that begin with another target than the one whose turn it is in a plan, up to
        its first resolution, each with the number of that target."""
        found = dict[str, int]()
        if not course.any_first:
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

    def _without_hopeless(
        self, floor: Floor, course: Course, start: JointState
    ) -> tuple[Course, Search, Answer]:
        """Search for a plan for the mission where none resolves all that is served: for as many
        obstacles as one resolves together, those that are served first before the others."""
        wanted, bare = self.state.last_settled.found.served, course.serving(frozenset())
        search = self.searches.search(floor, bare, start, work=self.work)
        answer = search.run(1)
        course = bare
        for gate in wanted if isinstance(answer, Found) else ():
            more = course.serving(course.served | {gate})
            tried = self.searches.search(floor, more, start, work=self.work)
            found = tried.run(1)
            if isinstance(found, Found):
                course, search, answer = more, tried, found
            elif isinstance(found, Exhausted):
                self.hopeless |= {gate}
        return course, search, answer

    @property
    def _rounds(self) -> int:
        """Rounds of the next search. A team that moves on for a while often has it easier, so
        each effort is made four times before a larger one."""
        return budgets.ROUNDS_FIRST + self.failures // 4

    def _look_for_few(self, floor: Floor, course: Course) -> None:
        """When a search has spent its budget for the first time, and now and then: whether a few
        of the robots can never complete. Raises RunEnded with the proof."""
        self.spent += 1
        if self.spent not in budgets.LOOKS_FOR_FEW:
            return
        counts = self.searches.counts(floor)
        active = [i for i, robot in enumerate(self.state.robots.values()) if robot.active]
        few = deadlock_of_few(floor, active, course.rounds, counts, self.thinking.check, self.work)
        if few is not None:
            raise deadlocked(self.state, *few)
