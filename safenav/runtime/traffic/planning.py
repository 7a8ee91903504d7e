"""Traffic on a shared floor: the starving robot, the joint plan that helps, and its execution.

The watch finds a robot that gets no nearer to its target. All finish the step that is in progress,
one plan is made for the whole team, and it is followed up to the first resolution, or until each
robot with goal poses has reached them once. The rest of the mission stays possible because the plan
is the beginning of one for all of it (docs/coordination.md).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import cached_property
from itertools import pairwise

from msgspec import Struct
from msgspec.structs import replace

from safenav.outcome import Outcome
from safenav.runtime.coordination.duties import Settlement
from safenav.runtime.coordination.problem import Floor
from safenav.runtime.coordination.snapshot import awaited_by
from safenav.runtime.coordination.waiting import in_the_way
from safenav.runtime.formulas import formulas_of
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.runtime.termination import Conclusion, RunEnded, Stop
from safenav.runtime.traffic.answers import Answer, Exhausted, Found, Spent
from safenav.runtime.traffic.budgets import (
    CERTIFICATE_CHAIN,
    LOOKS_FOR_FEW,
    MOST_FAILURES,
    MOST_FAILURES_HINDERED,
    ROUNDS_FIRST,
)
from safenav.runtime.traffic.continuation_plans import Certificates
from safenav.runtime.traffic.deadlock import deadlock_of_few, deadlocked
from safenav.runtime.traffic.execution import (
    Execution,
    Schedule,
    dues_of,
    schedule,
    still,
    still_needed,
    with_steps_under_way,
)
from safenav.runtime.traffic.joint import Count, Course, Joint, has_met
from safenav.runtime.traffic.joint_plan import Search
from safenav.runtime.traffic.local import local_plan
from safenav.runtime.traffic.meanwhile import Pending, free_to_go_on
from safenav.runtime.traffic.remembering import plain_poses, remembering
from safenav.runtime.traffic.searches import Searches
from safenav.runtime.traffic.shortening import shortened
from safenav.runtime.traffic.starvation import Watch
from safenav.runtime.traffic.thinking import Thinking, Unknown
from safenav.runtime.traffic.timed import quickest
from safenav.trace import records, vocabulary
from safenav.trace.header import heading_in_trace
from safenav.world.moves import Pose
from safenav.world.poses import FAR, Mask


class Traffic(Struct, dict=True):
    """Plans for a team, and where each robot is in the plan that is followed, if any."""

    state: TeamState
    stop: Stop
    clock: Callable[[], float]
    execution: Execution | None = None
    wanted: str | None = None
    _failures: int = 0
    _spent: int = 0
    _starved: str = ""
    _looked: float = -1.0
    hopeless: frozenset[str] = frozenset()
    """Obstacles that no joint state serves, as the last search has shown."""
    _served_nowhere: bool = False
    _cut_off: frozenset[int] = frozenset()
    _cleared: Settlement | None = None
    _hurried: Settlement | None = None
    _followed: Settlement | None = None
    _urgent: int | None = None
    _pending: Pending | None = None
    _all_wait: bool = False

    def __post_init__(self) -> None:
        robots = self.state.scenario.robots
        self.thinking = Thinking(self.stop)
        self._searches = Searches(self.state, self.thinking)
        self._tried: Counter[Hashable] = Counter()
        self._certificates = Certificates(self.state, self._searches)
        self._watch = Watch(max(robot.model.timing.most for robot in robots))
        sweeps = self.state.scenario.sweeping and len(robots) > 1
        self._rivals = {robot.name: sweeps or bool(self.state.rivals(robot)) for robot in robots}

    @cached_property
    def _turning(self) -> bool:
        """Whether a robot with headings shares its floor."""
        problem = self.state.last_settled.floor.problem
        return any(m.turns and problem.interferes(i) for i, m in enumerate(problem.members))

    @property
    def active(self) -> bool:
        return self.execution is not None

    def machine(self) -> Hashable:
        """All by which plans are made in lockstep without a surprise; None while one is."""
        if self.execution is not None or self.wanted is not None:
            return None
        found, tick = self.state.last_settled.found, self.state.tick
        tried = self._failures, self._spent, self._tried.total(), self._certificates.known
        return self._watch.ages(tick), tried, found is self._cleared, found is self._hurried

    def next_pose(self, name: str) -> Pose | None:
        """Return the pose that the plan has a robot take now; None if it stays: it is done, must
        let others go first, or has not yet counted the goals that the plan assumes met."""
        assert self.execution is not None
        floor = self.state.last_settled.floor
        index = floor.index(name)
        due = self.execution.due(index)
        if due is not None and not self._has_met(floor, index, due):
            return None
        number = self.execution.next(index)
        if number is None:
            return None
        return self.state.last_settled.floor.problem.members[index].graph.pose(number)

    def _has_met(self, floor: Floor, index: int, due: Count) -> bool:
        """Whether a robot has met what is due, or cannot by waiting: it does something else or is
        out of service, its goals are steps, or nothing that it still has to meet is here."""
        name, graph = floor.names[index], floor.problem.members[index].graph
        robot = self.state.robots[name]
        formulas = formulas_of(robot.robot, self.state.scenario.map)
        if robot.assignment.role is not Role.OWN or (formulas and not formulas.met_by_staying):
            return True
        if not robot.active:  # its member has no targets of its own objective
            return True
        if not awaited_by(floor, name, robot.own) >> graph.number(robot.pose) & 1:
            return True
        rounds = self._searches.course(floor).rounds
        return has_met(self._searches.counts(floor, rounds)[index], due)

    def arrived(self, name: str) -> None:
        """A robot has taken its next step of the plan."""
        if self.execution is not None:
            self.execution.arrived(self.state.last_settled.floor.index(name))

    def released(self, name: str) -> bool:
        """Live: whether a robot has done its way of the plan, and may leave it before the others:
        ``ahead`` is closed to it, and each move that it may not undo must be ``certified``."""
        index = self.state.last_settled.floor.index(name)
        return self.execution is not None and self.execution.done(index)

    def holds(self, name: str) -> bool:
        """Whether a robot stays where it is until a plan is there: one that is wanted, and is not
        to begin where the robot could not return to alone."""
        if self.wanted is None:
            return False
        return self._pending is None or not self._pending.may_go_on(name)

    def set_out(self) -> None:
        """A robot has set out on a step."""
        if self._pending is not None:
            self._pending.set_out(self._searches.floor().poses)

    def only_out(self, robots: Sequence[RobotState]) -> bool:
        """Whether each of some robots is out of service, or cut off by one that is."""
        return self._searches.only_out(robots)

    def ahead(self, name: str) -> Mask:
        """The regions that robots in conflict with this one still need for the plan."""
        if self.execution is None:
            return 0
        floor = self.state.last_settled.floor
        return still_needed(floor.problem, self.execution, floor.index(name))

    def quiescent(self, *, all_still: bool) -> bool:
        """Live: make a plan now if robots wait only for robots that wait; whether there is one.
        ``all_still``: no robot has a command. Raises RunEnded as ``tick``."""
        robots = self.state.robots
        if self.active or not self.state.scenario.deadlock or self._anybody_busy():
            return False
        if self.wanted is not None:
            return False  # a plan is searched
        waits = {}
        for name, robot in robots.items():
            sides = {robot.pose.region, *self.state.scenario.map.neighbours(robot.pose.region)}
            for each in self.state.scenario.never_together:
                sides |= each.regions if name in each.robots and sides & each.regions else set()
            rivals = self.state.rivals(robot.robot)
            for work in self.state.knowledge.pending.values():
                if swept := work.obstacle.swept(self.state.scenario.map):
                    near = swept | set(work.obstacle.resolution_regions(self.state.scenario.map))
                    sides |= swept if sides & near else set()
                    rivals = [other for other in robots.values() if other is not robot]
            waits[name] = [other.name for other in rivals if other.occupied & sides]
        moving = [name for name, robot in robots.items() if robot.transit is not None]
        floor = self._searches.aimed(self._searches.floor())
        for name in still(waits, moving):
            if not self._rivals[name] or not robots[name].active:
                continue
            if not 0 < self._distance(floor, name) < FAR:
                continue
            # The same again is worth it only while the budgets grow, and somebody must move first.
            key = floor.poses, floor.stages, tuple(robot.active for robot in robots.values())
            self._tried[key] += 1
            if self._tried[key] > (1 if not all_still or not all(key[2]) else 4 * MOST_FAILURES):
                return False
            self._starved = name
            self._plan(f"{name} makes no progress towards its target")
            return self.active
        return False

    def _anybody_busy(self) -> bool:
        """Whether a robot acts, or waits for a strategy."""
        return any(r.acting is not None or r.held is not None for r in self.state.robots.values())

    def _distance(self, floor: Floor, name: str) -> int:
        """Steps of a robot to its goal poses; FAR if it has none."""
        goal, index = self._searches.goal(floor, name), floor.index(name)
        if not goal:
            return FAR
        allowed = floor.problem.allowed(index, floor.stages)
        far = floor.problem.members[index].graph.distances(goal, allowed)[floor.poses[index]]
        duty = self.state.last_settled.found.duties.get(index)
        if far == 0 and duty is not None and floor.problem.gates[duty.gate].sweeps:
            return 1  # it stands where it is to act, but others where that sweeps
        return far

    def tick(self) -> vocabulary.PlanEndReason | None:
        """Examine the team after a tick; return why the plan ends, if it does: it is finished, or
        who acts next for what is due was chosen again. Raises RunEnded if no robot can continue, or
        a budget is exhausted."""
        if self.execution is not None:
            if self.execution.finished:
                return vocabulary.PlanEndReason.REACHED
            settled = self.state.last_settled
            again = settled.in_time is not None and settled.found is not self._followed
            return vocabulary.PlanEndReason.CHANGED if again else None
        if not self.state.scenario.deadlock or not any(self._rivals.values()):
            return None
        if self.state.live:
            now = self.clock()
            if now == self._looked or self._anybody_busy():
                return None  # nobody can have waited longer; or the others continue meanwhile
            self._looked = now
        if self.wanted is None:
            self.wanted = self._due() or self._clearing() or self._starving()
        moving = any(robot.transit is not None for robot in self.state.robots.values())
        moving = moving and not self.state.live
        if self.wanted is not None and not moving:
            reason, self.wanted = self.wanted, None
            if not self._hurry(reason):
                self._plan(reason)
        return None

    def end(
        self, reason: vocabulary.PlanEndReason, nodes: Mapping[str, int | None] | None = None
    ) -> None:
        """End the plan: it is finished, or something was learnt. ``nodes``: each robot's next
        strategy node."""
        self.wanted = self._pending = None
        if self.execution is not None:
            self.execution = None
            self.state.changes += 1
            self.state.emit(records.PlanEnd(self.state.tick, reason, nodes))
        self._watch.begin_anew()

    def certified(self, name: str, pose: Pose) -> bool:
        """Whether a robot may make a move that it may not be able to undo."""
        if self.execution is None:
            return self._certificates.allow(name, pose)
        return self._certificates.undone(name, pose, self.ahead(name))

    def _due(self) -> str | None:
        """Return why a plan is needed with the requests as they were settled last: something is
        due, and who acts for it next shares a floor. None if not, or one was wanted for that."""
        settled = self.state.last_settled
        if settled.found is self._hurried or settled.in_time is None:
            return None
        self._hurried = settled.found
        step = next(iter(settled.in_time.steps), None)
        if step is None or not any(self._rivals[settled.floor.names[i]] for i in step.group):
            return None
        self._urgent, self._starved = step.gate, settled.floor.names[step.group[0]]
        return f"{settled.floor.gates[step.gate]} is due"

    def _hurry(self, reason: str) -> bool:
        """Begin the quickest plan for what is due, if it is for that and there is one; whether no
        other plan is to be made now."""
        gate, self._urgent = self._urgent, None
        if gate is not None and self._hurried is not self.state.last_settled.found:
            return True  # it is decided again since
        floor = self._searches.floor()
        states = None if gate is None else self._quickest(floor, gate)
        if states is None:
            return False
        counts = self._searches.counts(floor, self._searches.course(floor).rounds)
        self._begin(floor, states, counts, reason)
        return True

    def _quickest(self, floor: Floor, gate: int) -> list[Joint] | None:
        """The quickest plan for the next need of an obstacle, if the team can continue then."""
        if remembering(self._searches.aimed(floor).problem):
            return None
        goals = [self._searches.goal(floor, name) for name in floor.names]
        found = quickest(floor, gate, goals, self.stop.check)
        if found is None:
            return None
        course = self._searches.course(floor)
        counts = self._searches.counts(floor, course.rounds)
        states = [course.begun(found[0], counts, floor.stages)]
        for poses in found[1:]:
            states.append(course.moved(states[-1], poses, range(len(poses))))
        if self._turning:
            after = self._searches.search(floor, course, states[-1]).run(1)
            if not isinstance(after, Found):
                return None
            self._certificates.keep(course, (*states, *after.states[1:]))
        return states

    def _straightened(self, floor: Floor, states: list[Joint]) -> list[Joint]:
        """A plan on which a robot steps more often than it has poses (two that must stand in
        different places drive each other round and round), or the quickest one instead of it."""
        robot = self.state.robots[self._starved]
        ways = zip(*(state.poses for state in states), strict=True)
        graphs = (member.graph for member in floor.problem.members)
        turns = any(
            sum(a != b for a, b in pairwise(way)) > graph.everywhere.bit_count()
            for way, graph in zip(ways, graphs, strict=True)
        )
        obstacle = robot.assignment.obstacle
        if not turns or robot.assignment.role is not Role.HELPS or obstacle not in floor.gates:
            return states
        found = self._quickest(floor, floor.gates.index(obstacle))
        return states if found is None or len(found) >= len(states) else found

    def _clearing(self) -> str | None:
        """Return why a plan is needed with the requests as they were settled last: a robot that
        waits for help stands in the helper's way. None if none does, or one was wanted for that."""
        settled = self.state.last_settled
        if settled.found is self._cleared:
            return None
        self._cleared = settled.found
        floor, duties = self._searches.floor(), settled.found.duties
        for index, (name, robot) in enumerate(self.state.robots.items()):
            helpers = sorted(floor.problem.conflicts[index] & duties.keys())
            if robot.assignment.role is not Role.WAITS or not robot.active or not helpers:
                continue
            if in_the_way(floor, duties, index, robot.next_pose.region):
                self._starved = floor.names[helpers[0]]
                return f"{name} stands in the way of {self._starved}"
        return None

    def _starving(self) -> str | None:
        """Return the first robot that makes no progress towards its assigned target; None if there
        is none."""
        floor = self._searches.aimed(self._searches.floor())
        found = None
        for name, robot in self.state.robots.items():
            if not self._rivals[name]:
                continue
            goal = self._searches.goal(floor, name)
            distance = self._distance(floor, name)
            told = (robot.assignment.objective, goal, floor.stages)
            if self._watch.look(name, told, distance, self.clock()) and found is None:
                found, self._starved = f"{name} makes no progress towards its target", name
        return found

    def _plan(self, reason: str) -> None:
        """Make a plan and begin it. Raises RunEnded with the proof if there is none."""
        here = self._searches.floor()
        helping = any(r.assignment.role is Role.HELPS for r in self.state.robots.values())
        pending = self._search_from(here)
        plain = pending.floor
        floor = self._searches.aimed(plain)
        try:
            floor, course, start, answer = self.thinking.ask(
                pending.moment, lambda: self._sought(plain, floor, helping)
            )
        except Unknown:
            self.wanted, self._pending = reason, pending
            return
        except RunEnded:
            self.stop.check()
            if not pending.moved:
                raise
            self._search_again(reason)  # a proof is of where the robots are
            return
        self._pending, self._all_wait = None, False
        if isinstance(answer, Exhausted) and pending.moved:
            self._search_again(reason)
            return
        if self.state.live and start.stages != floor.stages:
            return  # a robot is about to resolve something: that changes what is possible
        if self._served_nowhere and isinstance(answer, Found) and floor is plain:
            served = self.state.last_settled.found.served
            self.hopeless = frozenset(floor.gates[gate] for gate in served)
            self._watch.begin_anew()
            return  # the others complete the mission without
        if isinstance(answer, Exhausted) and not all(r.active for r in self.state.robots.values()):
            self._watch.begin_anew()  # somebody stands in the way who may come back
            return
        if isinstance(answer, Exhausted) and floor.problem.sweeping:
            said = f"no order of moves was found in which swept regions are free: {reason}"
            raise RunEnded(Conclusion(Outcome.SEARCH_LIMIT, said))  # that is not proven
        if isinstance(answer, Exhausted):
            raise deadlocked(self.state, replace(floor, stages=start.stages), course, answer)
        if isinstance(answer, Spent):
            self._failures += 1
            self._watch.begin_anew()
            if self._failures > (MOST_FAILURES_HINDERED if self._hindered else MOST_FAILURES):
                said = f"search budget exhausted while planning joint moves: {reason}"
                raise RunEnded(Conclusion(Outcome.SEARCH_LIMIT, said))
            return
        self._failures = 0
        if self._turning:
            self._certificates.keep(course, answer.states)
        counts = self._searches.counts(floor, course.rounds)
        cut = self._cut(course, start, answer.states, helping)
        states = pending.from_here(course, counts, cut)
        if states is None:
            self._search_again(reason)
            return
        states = self._straightened(here, states) if helping else states
        charges = self._charges(self.state.robots[self._starved])
        short = charges and not self._leg_done(course, start, states[-1], helping)
        if short or self._changes_nothing(here, states, counts):
            leg = self._leg(floor, course, start)
            states = (leg and pending.from_here(course, counts, leg)) or states
        self._begin(floor, states, counts, reason)

    def _search_from(self, here: Floor) -> Pending:
        """The search that is under way, if it is of use from here; else one that begins here."""
        if not self.thinking.background:
            return Pending(here, None, None, [here.poses])
        robots = self.state.robots.values()
        each = tuple((r.active, r.assignment) for r in robots)
        team = here.stages, id(self.state.last_settled.found), repr(each)
        if self._pending is not None and self._pending.serves(here, team):
            return self._pending
        counts = self._searches.counts(here, self._searches.course(here).rounds)
        moment = here.poses, counts, team, self._all_wait
        free = () if self._all_wait else free_to_go_on(here, robots)
        return Pending(here, moment, team, [here.poses], free)

    def _search_again(self, reason: str) -> None:
        """Search for a plan from here while all robots stand."""
        self.wanted, self._pending, self._all_wait = reason, None, True

    def _sought(
        self, plain: Floor, floor: Floor, helping: bool
    ) -> tuple[Floor, Course, Joint, Answer]:
        """Search for a plan, the last resorts included; return also where it begins. Raises
        RunEnded as ``_look_for_few``."""
        course, start, search, answer = self._searched(floor, helping)
        if self.state.live and start.stages != floor.stages:
            return floor, course, start, answer
        if isinstance(answer, Exhausted) and floor is not plain:
            if remembering(floor.problem):
                self._searches.give_up(plain)
            floor = plain  # the strategies' own ways are not all that there are
            course, start, search, answer = self._searched(floor, helping)
        if isinstance(answer, Spent):
            self._look_for_few(plain, course)
            answer = (None if self._turning else local_plan(search)) or answer
        return floor, course, start, answer

    def _look_for_few(self, floor: Floor, course: Course) -> None:
        """When a search has spent its budget for the first time, and now and then: whether a few
        of the robots can never complete. Raises RunEnded with the proof."""
        self._spent += 1
        if self._spent not in LOOKS_FOR_FEW:
            return
        counts = self._searches.counts(floor, course.rounds)
        active = [i for i, robot in enumerate(self.state.robots.values()) if robot.active]
        few = deadlock_of_few(floor, active, course.rounds, counts, self.thinking.check)
        if few is not None:
            raise deadlocked(self.state, *few)

    def _changes_nothing(
        self, floor: Floor, states: Sequence[Joint], counts: Sequence[Count]
    ) -> bool:
        """Whether a plan moves no robot, and lets none wait for a goal that it has yet to meet."""
        if len({state.poses for state in states}) > 1:
            return False
        dues = enumerate(dues_of(states, counts))
        return all(self._has_met(floor, i, count) for i, due in dues for count in due.values())

    def _leg(self, floor: Floor, course: Course, start: Joint) -> list[Joint] | None:
        """Return moves that bring at least the starving robot to its target: formulas may
        remember, so that a plan for all assumes goals as met that are not. None if there are no
        such moves, or the team could not continue after them."""
        index = floor.index(self._starved)
        goal = self._searches.goal(floor, self._starved)
        search = self._searches.search(floor, course, start, {index: goal})
        search.goal = lambda state: (
            state.stages != start.stages or bool(goal >> state.poses[index] & 1)
        )
        answer = search.run(1)
        if not isinstance(answer, Found):
            return None
        after = self._searches.search(floor, course, answer.states[-1])
        if self._turning and not isinstance(after.run(1), Found):
            return None
        return list(answer.states)

    @property
    def _hindered(self) -> bool:
        """Whether a robot out of service shares its floor, and plans are for the whole mission."""
        robots = self.state.robots
        out = any(not robot.active and self._rivals[name] for name, robot in robots.items())
        return out and self._turning

    @property
    def _rounds(self) -> int:
        """Rounds of the next search. A team that moves on for a while often has it easier, so
        each effort is made four times before a larger one."""
        return ROUNDS_FIRST + self._failures // 4

    def _searched(self, floor: Floor, helping: bool) -> tuple[Course, Joint, Search, Answer]:
        """Search for a plan; return the search and its result."""
        self._served_nowhere = False
        self._cut_off = self._searches.cut_off(floor)
        course = self._searches.course(floor)
        start = course.begun(floor.poses, self._searches.counts(floor, course.rounds), floor.stages)
        search = self._searches.search(floor, course, start)
        if self._turning and self._searches.cut_off(floor, every=True):
            return course, start, search, Spent(0)  # the mission cannot be completed as it is
        if self._turning or remembering(floor.problem):
            hindered = self._hindered
            answer = search.run(1, chain=CERTIFICATE_CHAIN) if hindered else search.run(1)
            if isinstance(answer, Spent):
                answer = self._certificates.again(course, start) or answer
            if isinstance(answer, Spent) and self._turning and not hindered:
                answer = search.run(self._rounds)
            if self._turning or not isinstance(answer, Spent):
                return course, start, search, answer
        # Everything can be undone: a plan that serves those that want something is safe.
        search.goal = lambda state: self._leg_done(course, start, state, helping)
        answer = search.run(self._rounds, 0)
        self._served_nowhere = helping and isinstance(answer, Exhausted)
        if isinstance(answer, Exhausted):
            search.goal = course.completed
            answer = search.run(ROUNDS_FIRST)
        return course, start, search, answer

    def _leg_done(self, course: Course, start: Joint, state: Joint, helping: bool) -> bool:
        if state.stages != start.stages:
            return True
        return not helping and self._each_has_counted(course, start, state)

    def _each_has_counted(self, course: Course, start: Joint, state: Joint) -> bool:
        """Whether each robot with goal poses has reached them once; of those that go to a charger
        only the one that starves."""
        for index, robot in enumerate(self.state.robots.values()):
            if self._charges(robot) and not self._at_stop(course, state, index, robot):
                return False
            if robot.assignment.role is not Role.OWN or not robot.active:
                continue
            if course.is_done(index, start.counts[index]) or index in self._cut_off:
                continue
            if state.counts[index] == start.counts[index]:
                return False
        return True

    def _charges(self, robot: RobotState) -> bool:
        """Whether it is the robot that starves, on its way to a charger."""
        starves = robot.name == self._starved and robot.active
        return starves and robot.assignment.role is Role.CHARGES

    def _at_stop(self, course: Course, state: Joint, index: int, robot: RobotState) -> bool:
        pose = plain_poses(course.problem, state.poses)[index]
        return bool(robot.assignment.goal >> pose & 1)

    def _cut(
        self, course: Course, start: Joint, states: Sequence[Joint], helping: bool
    ) -> list[Joint]:
        """The plan up to the first resolution, or until each has counted once."""
        found = []
        for state in states:
            found.append(state)
            if self._leg_done(course, start, state, helping):
                break
        return found

    def _begin(
        self, floor: Floor, states: Sequence[Joint], counts: Sequence[Count], reason: str
    ) -> None:
        states = shortened(self._searches.course(floor), states, self._fixed(floor))
        sizes = [member.graph.size for member in floor.problem.members]
        poses = [plain_poses(floor.problem, state.poses) for state in states]
        under_way = {}
        for index, robot in enumerate(self.state.robots.values()):
            if robot.transit is not None:
                under_way[index] = floor.problem.members[index].graph.number(robot.pose)
                robot.transit = replace(robot.transit, planned=True)
        poses, states = with_steps_under_way(poses, states, counts, under_way)
        plan = schedule(poses, sizes, floor.problem.conflicts, floor.problem.apart, under_way)
        self._followed = self.state.last_settled.found
        self.execution = Execution(plan, dues_of(states, counts))
        self.state.changes += 1
        self._watch.begin_anew()
        self.state.emit(_record(self.state.tick, floor, plan, reason))

    def _fixed(self, floor: Floor) -> list[int]:
        """The robots that must end where a plan leads them: that is why it was made, or what makes
        the rest of the mission possible."""
        return [
            index
            for index, robot in enumerate(self.state.robots.values())
            if self._turning
            or floor.problem.members[index].turns
            or robot.assignment.role is Role.HELPS
            or robot.name == self._starved
        ]


def _record(tick: int, floor: Floor, plan: Schedule, reason: str) -> records.Plan:
    """A plan as it stands in a trace."""
    robots = {}
    for index, (name, way) in enumerate(zip(floor.names, plan.ways, strict=True)):
        graph = floor.problem.members[index].graph
        poses = [graph.pose(number) for number in way]
        robots[name] = tuple((pose.region, heading_in_trace(pose)) for pose in poses)
    names = floor.names
    orders = tuple(
        # Step k leads from place k to place k + 1.
        (names[order.other], order.before + 1, names[order.robot], order.step + 1)
        for order in plan.orders
    )
    return records.Plan(tick, reason, robots, orders)
