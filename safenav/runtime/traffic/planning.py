"""Traffic on a shared floor: starvation, the joint plan that resolves it, and its execution.

The monitor detects a robot that makes no progress towards its target. All robots finish their
steps, and one plan is made for the whole team. The mission stays feasible because the plan is the
beginning of a plan for the whole mission (docs/coordination.md).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from msgspec.structs import replace

from safenav.outcome import Outcome
from safenav.runtime.coordination.snapshot import floor_of
from safenav.runtime.resolution.problem import Floor
from safenav.runtime.team import Role, TeamState
from safenav.runtime.termination import Conclusion, RunEnded, Stop
from safenav.runtime.traffic import budgets
from safenav.runtime.traffic.background_search import (
    BackgroundSearch,
    PendingSearch,
    Unknown,
    free_to_go_on,
)
from safenav.runtime.traffic.continuation_plans import ContinuationPlans
from safenav.runtime.traffic.deadlock import crowded, deadlocked, meets_the_rest_alone
from safenav.runtime.traffic.joint_search.shortening import shortened
from safenav.runtime.traffic.joint_search.states import (
    Answer,
    BudgetExhausted,
    Count,
    Course,
    Effort,
    Exhausted,
    Found,
    JointState,
)
from safenav.runtime.traffic.plan_progress import PlanProgress
from safenav.runtime.traffic.plan_search import PlanSearch
from safenav.runtime.traffic.plan_triggers import PlanTrigger, PlanTriggers
from safenav.runtime.traffic.resolution_plans import ResolutionPlans
from safenav.runtime.traffic.searches import Searches, SearchProblem
from safenav.scenario.settings import Coordination
from safenav.trace import vocabulary
from safenav.world.moves import Pose


class Traffic:
    """Makes joint plans for a team. ``plan``: its progress in the current one."""

    def __init__(self, state: TeamState, stop: Stop, clock: Callable[[], float]) -> None:
        self.state = state
        self.stop = stop
        self.clock = clock
        self.wanted: PlanTrigger | None = None
        self._looked = -1.0
        self._pending: PendingSearch | None = None
        self._all_wait = False
        self.thinking = BackgroundSearch(stop)
        self.searches = searches = Searches(state, self.thinking)
        self._certificates = certificates = ContinuationPlans(state, searches)
        self._in_service = ContinuationPlans(state, searches, in_service=True)
        self.occasions = PlanTriggers(state, searches, clock)
        self.search = PlanSearch(state, searches, certificates, self._in_service)
        self.resolving = ResolutionPlans(state, searches, self.search)
        self.plan = PlanProgress(state, searches)

    def given_up(self) -> frozenset[str]:
        """The obstacles that no joint state can serve, by a search since the last call."""
        notes = self.state.last_settled.notes
        found, notes.hopeless = notes.hopeless, frozenset()
        return found

    def turned(self) -> Mapping[str, int]:
        """The robots that, by a search since the last call, must begin with another target, each
        with that target; none if the team has decided again since then."""
        notes = self.state.last_settled.notes
        found = notes.turned or {}
        if found:
            notes.turned = {}
        return found

    def holds(self, name: str) -> bool:
        """Return whether a robot stays until a requested plan is available: the robot could not
        return alone to the state in which the plan begins."""
        if self.wanted is None:
            return False
        return self._pending is None or not self._pending.may_go_on(name)

    def set_out(self) -> None:
        """Record that a robot has departed."""
        if self._pending is not None:
            self._pending.set_out(self.searches.floor().poses)

    def quiescent(self, *, all_still: bool) -> bool:
        """Live: make a plan if robots wait in a circle; return whether there is one, or another
        search may find one. ``all_still``: no robot has a command. Raises RunEnded as ``tick``."""
        if self.plan.active or self._anybody_busy():
            return False
        if self.wanted is not None:
            return False  # a search for a plan is running
        occasion, failures = self.occasions.stuck(all_still=all_still), self.search.failures
        if occasion is not None:
            self._plan(occasion)
        return self.plan.active or self.search.failures > failures

    def _anybody_busy(self) -> bool:
        """Return whether a robot acts, or waits for a strategy."""
        return any(r.acting is not None or r.held is not None for r in self.state.robots.values())

    def tick(self) -> vocabulary.PlanEndReason | None:
        """Examine the team after a tick; return the reason if the plan ends. Raises RunEnded if no
        robot can continue, or a budget is exhausted."""
        if self.plan.execution is not None:
            return vocabulary.PlanEndReason.REACHED if self.plan.execution.finished else None
        if not self.searches.sharing:
            return None
        if self.state.live:
            now = self.clock()
            if now == self._looked or self._anybody_busy():
                return None  # waits are unchanged, or the other robots continue meanwhile
            self._looked = now
        if self.wanted is None:
            self.wanted = self.occasions.next()
        moving = any(robot.transit is not None for robot in self.state.robots.values())
        moving = moving and not self.state.live
        if self.wanted is not None and not moving:
            occasion, self.wanted = self.wanted, None
            self._plan(occasion)
        return None

    def free(self, name: str) -> None:
        """Request a plan for a robot that has no strategy from its pose."""
        if not self.plan.active and self.wanted is None:
            self.wanted = PlanTrigger(f"{name} has no strategy from where it is", name)
            self._looked = -1.0

    def look_again(self) -> None:
        """Abandon the search for a plan after a decision, unless its robot is off its strategy: the
        plan may no longer be needed."""
        wanted = self.wanted
        if wanted is None or not self.thinking.background:
            return
        if self.state.robots[wanted.robot].planner.node is not None:
            self.wanted = self._pending = None
            self._looked = -1.0
            self.thinking.abandon()

    def end(
        self, reason: vocabulary.PlanEndReason, nodes: Mapping[str, int | None] | None = None
    ) -> None:
        """End the plan: it is finished, or there is a new fact. ``nodes``: each robot's next
        strategy node."""
        self.wanted = self._pending = None
        self.plan.end(reason, nodes)
        self.occasions.watch.begin_anew()

    def certified(self, name: str, pose: Pose) -> bool:
        """Return whether a robot may make a move that may be irreversible."""
        if not self.plan.active:
            plans = self._certificates, self._in_service
            return all(each.allow(name, pose) for each in plans)
        return self._certificates.undone(name, pose, self.plan.ahead(name))

    def _plan(self, occasion: PlanTrigger) -> None:
        """Make a plan and begin it. Raises RunEnded with the proof if there is none."""
        if (ended := crowded(self.state)) is not None:
            raise ended
        here, self.search.starved = self.searches.floor(), occasion.robot
        pending = self._search_from(here)
        found = self._sought(pending, occasion)
        if found is None:
            return
        problem, answer = found
        floor = problem.floor
        if self.state.live and problem.start.stages != floor.stages:
            return  # a robot is about to resolve an obstacle, which may allow other plans
        if not isinstance(answer, Found):
            self._without_plan(problem, answer, occasion)
            return
        if self.search.hopeless and floor is pending.floor:  # the others complete the mission
            self._set_aside(floor, self.search.hopeless)
            return
        self.search.failures = self.search.used = 0
        if self._must_turn(problem, answer):
            return  # new strategies begin with those targets; then another plan is made
        if self.searches.turning:
            self._certificates.keep(problem.course, answer.states)
        counts = self.searches.counts(floor)
        cut = self.search.cut(problem, answer.states)
        states = pending.from_here(problem.course, counts, cut)
        if states is None:
            self._search_again(occasion)
            return
        short = self.search.charges(self.state.robots[occasion.robot])
        short = short and not self.search.starving_is_there(problem, states[-1])
        if short or self.plan.changes_nothing(here, states, counts):
            leg = self.search.leg(problem)
            hemmed_in = self.state.last_settled.notes.hemmed_in
            if leg is None and floor.index(occasion.robot) in hemmed_in:
                self.occasions.watch.begin_anew()
                return
            states = (leg and pending.from_here(problem.course, counts, leg)) or states
        self._begin(floor, states, counts, occasion.reason)

    def _sought(
        self, pending: PendingSearch, occasion: PlanTrigger
    ) -> tuple[SearchProblem, Answer] | None:
        """The result of a search with its problem and first state; None if it is not available yet,
        or does not apply to the robots' present state."""
        plain = pending.floor
        floor = self.searches.remembered(plain)
        try:
            found = self.thinking.ask(pending.moment, lambda: self.search.sought(plain, floor))
        except Unknown:
            self.wanted, self._pending = occasion, pending
            return None
        except RunEnded:
            self.stop.check()
            if not pending.moved:
                raise
            self._search_again(occasion)  # a proof must concern the present state
            return None
        self._pending, self._all_wait = None, False
        if isinstance(found[-1], Exhausted) and pending.moved:
            self._search_again(occasion)
            return None
        return found

    def _without_plan(
        self, problem: SearchProblem, answer: Exhausted | BudgetExhausted, occasion: PlanTrigger
    ) -> None:
        """Handle a search without a plan: the robots wait for one that is out of service, or for a
        search with a larger budget. Raises RunEnded if neither can help."""
        if isinstance(answer, Exhausted):
            if not self.state.out_of_service:
                raise deadlocked(self.state, problem.floor, problem.course, answer)
            self.search.hopeless = frozenset()
            self.search.leg(problem)  # a robot in the way may return to service
            self._set_aside(problem.floor, self.search.hopeless)
            self._note_impasse(problem.floor)
            return
        self.search.failures += 1
        self.search.used = budgets.MOST_WORK - self.search.work.left
        self.occasions.watch.begin_anew()
        most = budgets.MOST_FAILURES_HINDERED if self.search.hindered else budgets.MOST_FAILURES
        if self.search.failures > most or self.search.work.done:
            words = f"search budget exhausted while planning joint moves: {occasion.reason}"
            raise RunEnded(Conclusion(Outcome.SEARCH_LIMIT, words))

    def _note_impasse(self, floor: Floor) -> None:
        """Record that no plan helps before a robot returns to service. If the others have been in
        this state before, they make no progress by themselves: mark all as blocked."""
        notes, robots = self.state.last_settled.notes, self.state.robots.values()
        done = ((self.state.rounds_counted(r), r.own.memory.index, r.own.seen) for r in robots)
        now = floor.poses, tuple(done), tuple(robot.charge for robot in robots)
        if now in notes.impasses:
            notes.hemmed_in |= {i: each.pose for i, each in enumerate(robots) if each.active}
        notes.impasses.add(now)

    def _set_aside(self, floor: Floor, gates: frozenset[int]) -> None:
        """Defer planning, and set these obstacles aside."""
        hopeless = frozenset(floor.gates[gate] for gate in gates)
        self.state.last_settled.notes.hopeless = hopeless
        self.occasions.watch.begin_anew()

    def _must_turn(self, problem: SearchProblem, answer: Found) -> bool:
        """Return whether robots first need strategies that begin with another target, as a plan
        requires."""
        turned = self.search.turned(problem, answer.states)
        notes = self.state.last_settled.notes
        if not turned or notes.turned is not None:
            return False
        notes.turned = turned
        self.occasions.watch.begin_anew()
        return True

    def proven(self, end: Conclusion) -> Conclusion:
        """Return the conclusion if a robot has no strategy for the remaining targets of a ``once``
        that it could meet alone, with the proof that no order of moves completes it. Without a
        proof the run ends without a verdict. Other conclusions are unchanged."""
        state = self.state
        robots = [state.robots[name] for name in end.stuck if end.proof is None]
        if end.outcome is not Outcome.OPERATOR_NEEDED or not end.unrealizable or not robots:
            return end
        floor, wanted = floor_of(state), state.scenario.until.rounds
        returns = state.scenario.coordination is Coordination.ASSIGNABLE
        if not all(meets_the_rest_alone(floor, robot, returns=returns) for robot in robots):
            return end
        course = Course(floor.problem, wanted, any_first=True)
        problem = self.searches.problem(floor, course)
        search = self.searches.search(problem, work=Effort(budgets.MOST_WORK))
        answer = search.singles(budgets.PROOF_BUDGET)
        if not isinstance(answer, Exhausted):
            words = f"{end.explanation}; this does not prove that no order of moves helps"
            return Conclusion(Outcome.SEARCH_LIMIT, words)
        found = deadlocked(state, floor, course, answer).conclusion
        links = (*end.links, found.explanation)
        return replace(
            found,
            explanation="; ".join(links),
            links=links,
            stuck=end.stuck,
            unrealizable=end.unrealizable,
        )

    def _search_from(self, here: Floor) -> PendingSearch:
        """Return the running search if it applies to the present state, else a new one."""
        if not self.thinking.background:
            return PendingSearch(here, None, None, [here.poses])
        robots = self.state.robots.values()
        each = tuple((r.active, r.assignment) for r in robots)
        team = here.stages, id(self.state.last_settled.found), repr(each)
        if self._pending is not None and self._pending.serves(here, team):
            return self._pending
        counts = self.searches.counts(here)
        moment = here.poses, counts, team, self._all_wait
        free = () if self._all_wait else free_to_go_on(here, robots)
        return PendingSearch(here, moment, team, [here.poses], free)

    def _search_again(self, occasion: PlanTrigger) -> None:
        """Search for a plan from the present state while all robots stand."""
        self.wanted = occasion
        self._pending, self._all_wait = None, True

    def _begin(
        self, floor: Floor, states: Sequence[JointState], counts: Sequence[Count], reason: str
    ) -> None:
        short = shortened(self.searches.course(floor), states, self._fixed(floor), self.stop.check)
        if self.searches.has_charge(floor, short) or not self.searches.has_charge(floor, states):
            states = short  # otherwise it omits a stop at a charger
        ends, states = states[-1].poses, self.resolving.approached(floor, states)
        pairs = zip(floor.names, ends, states[-1].poses, strict=True)
        notes = self.state.last_settled.notes
        notes.followers = frozenset(name for name, end, now in pairs if now != end)
        notes.followed = True
        self.occasions.watch.begin_anew()
        self.plan.begin(floor, states, counts, reason)

    def _fixed(self, floor: Floor) -> list[int]:
        """Return the robots that must end in their planned poses: those for which the plan is made,
        those whose objective ends, and those whose final pose keeps the mission feasible."""
        return [
            index
            for index, robot in enumerate(self.state.robots.values())
            if self.searches.turning
            or floor.problem.members[index].turns
            or floor.problem.members[index].settles
            or index in self.searches.stays(floor)
            or robot.assignment.role is Role.HELPS
            or robot.name == self.search.starved
        ]
