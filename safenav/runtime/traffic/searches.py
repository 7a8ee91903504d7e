"""Joint searches from the present state: the floor of the last decision, the rounds that a plan
looks ahead, each robot's counts, and its assignment."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.coordination.snapshot import awaited_by, floor_of, moved_on
from safenav.runtime.duties.settlement import settle
from safenav.runtime.formulas import formulas_of
from safenav.runtime.resolution.problem import BudgetExhaustedError, Floor, Problem, Stages
from safenav.runtime.stops import Stops
from safenav.runtime.team import RobotState, Role, TeamState
from safenav.runtime.traffic.background_search import BackgroundSearch
from safenav.runtime.traffic.budgets import ROUNDS_AHEAD
from safenav.runtime.traffic.joint_search import formula_memory
from safenav.runtime.traffic.joint_search.search import Goal, Search
from safenav.runtime.traffic.joint_search.states import Count, Course, Effort, JointState
from safenav.scenario.objective import Ltl
from safenav.world.poses import FAR, Mask, region_mask

_Graphs = dict[int, formula_memory.StateGraph]


Goals = Mapping[int, Mask | None]
"""The goal poses of some robots; None: those of the robot's own objective."""


class SearchProblem(Struct, frozen=True):
    """A search problem for a joint plan: its floor, its rules, and its first joint state.
    ``goals``: initial goals in place of the assigned ones."""

    floor: Floor
    course: Course
    start: JointState
    goals: Goals = {}

    def at(self, start: JointState) -> SearchProblem:
        """Return the same problem from another joint state."""
        return replace(self, start=start)


class Searches:
    """Builds search problems for joint plans from the present state, and their searches."""

    def __init__(self, state: TeamState, stop: BackgroundSearch) -> None:
        self._state = state
        self._stop = stop
        self._remembering: dict[bool, tuple[Problem, _Graphs, Problem]] = {}
        self._hopeless: Problem | None = None
        self._in_service: tuple[Floor, Floor] | None = None
        robots = state.scenario.robots
        self.sharing = frozenset(r.name for r in robots if state.rivals(r))
        """The robots that share their floor with others."""

    @property
    def turning(self) -> bool:
        """Return whether a robot with headings shares its floor."""
        problem = self._state.last_settled.floor.problem
        return any(m.turns and problem.interferes(i) for i, m in enumerate(problem.members))

    def check(self) -> None:
        """Raise the exception that ends a search from outside, if any."""
        self._stop.check()

    def floor(self) -> Floor:
        """Return the floor of the last decision, with every robot at its present pose."""
        return moved_on(self._state.last_settled.floor, self._state)

    def in_service(self) -> Floor:
        """Return the same problem as if every robot were in service."""
        settled = self._state.last_settled.floor
        if self._in_service is None or self._in_service[0] is not settled:
            found = floor_of(self._state, hopeful=True)
            self._in_service = settled, found if found.gates == settled.gates else settled
        return moved_on(self._in_service[1], self._state)

    def remembered(self, floor: Floor) -> Floor:
        """Return the problem with formula memory added to poses, within a size limit."""
        graphs, poses = self._states(floor)
        if not graphs or floor.problem is self._hopeless:
            return floor
        return replace(floor, problem=self._with_memory(floor.problem, graphs), poses=poses)

    def everything(self, floor: Floor) -> Floor | None:
        """Return the problem including the memory changes of robots that stay, for proofs; None if
        a robot is in transit, since its memory changes at the end of its step, or if formulas name
        inputs."""
        graphs, poses = self._states(floor, stays=True)
        robots = [self._state.robots[floor.names[index]] for index in graphs]
        named = (robot.robot.objective for robot in robots)
        if any(isinstance(each, Ltl) and each.inputs for each in named):
            return None
        if not robots or any(robot.transit is not None for robot in robots):
            return None
        problem = self._with_memory(floor.problem, graphs, stays=True)
        return replace(floor, problem=problem, poses=poses)

    def _with_memory(self, problem: Problem, graphs: _Graphs, *, stays: bool = False) -> Problem:
        """Return the problem with these graphs; the previous object if they are unchanged."""
        of, last, found = self._remembering.get(stays, (None, {}, problem))
        if of is not problem or last != graphs:
            found = formula_memory.with_memory(problem, graphs)
            self._remembering[stays] = problem, graphs, found
        return found

    def _states(self, floor: Floor, *, stays: bool = False) -> tuple[_Graphs, tuple[int, ...]]:
        """Return the state graphs of robots with formula memory, and the states of all robots."""
        poses, graphs = list(floor.poses), _Graphs()
        for index, robot in enumerate(self._state.robots.values()):
            objective, mobility = robot.robot.objective, robot.robot.model.mobility
            if not isinstance(objective, Ltl) or not robot.active:
                continue
            world = self._state.scenario.map
            graph = formula_memory.state_graph(objective, world, mobility, stays=stays)
            state = (
                graph.state(poses[index], robot.next_memory.values) if graph is not None else None
            )
            if graph is not None and state is not None:
                graphs[index], poses[index] = graph, state
        return graphs, tuple(poses)

    def give_up(self, floor: Floor) -> None:
        """Ignore the memory of robots for this problem: with it there is no plan from here or from
        any state that they can reach. They continue as if without memory."""
        self._hopeless = floor.problem

    def _has_met_rounds(self, robot: RobotState) -> bool:
        return robot.own.rounds >= self._state.scenario.until.rounds

    def goal(self, floor: Floor, name: str) -> Mask:
        """Return the poses that a robot must reach now; empty for a robot that waits or is done."""
        robot = self._state.robots[name]
        owns = robot.assignment.role is Role.OWN
        if not robot.active or (owns and self._state.has_done_all(robot)):
            return 0
        goal = self._goal_poses(floor, name)
        return awaited_by(floor, name, robot.own) if goal is None else goal

    def _goal_poses(
        self, floor: Floor, name: str, cut_off: Collection[int] | None = None
    ) -> Mask | None:
        """Return the goal poses of a robot by its assignment; None: those of its own objective."""
        robot, index = self._state.robots[name], floor.index(name)
        if robot.assignment.role in (Role.HELPS, Role.CHARGES):
            return _lifted(floor, index, robot.assignment.goal)
        if robot.assignment.role is Role.WAITS:
            return 0
        return 0 if index in (self.cut_off(floor) if cut_off is None else cut_off) else None

    def cut_off(self, floor: Floor, *, every: bool = False) -> frozenset[int]:
        """Return the robots that cannot reach their own next target (``every``: or any remaining
        target of this round) past robots out of service. No plan can serve them before one of these
        returns."""
        robots, found = [*self._state.robots.values()], set[int]()
        if not self._state.out_of_service:
            return frozenset()
        floor = self.everything(self.floor()) or floor
        members = floor.problem.members
        for index, robot in enumerate(robots):
            out = [other for other in floor.problem.conflicts[index] if not robots[other].active]
            if not out or not robot.active or robot.assignment.role is not Role.OWN:
                continue
            graph = members[index].graph
            places = region_mask(robots[other].next_pose.region for other in out)
            allowed = floor.problem.allowed(index, floor.stages) & ~graph.poses_on(places)
            goals = [awaited_by(floor, robot.name, robot.own)]
            if every and not self._has_met_rounds(robot):
                goals += [
                    t for k, t in enumerate(members[index].targets) if k not in robot.own.seen
                ]
            fields = (graph.distances(goal & allowed, allowed) for goal in goals)
            if any(field[floor.poses[index]] >= FAR for field in fields):
                found.add(index)
        return frozenset(found) | self._state.last_settled.notes.hemmed_in.keys()

    def own_of_charging(self) -> dict[int, None]:
        """Return the goals of robots that go to a charger, for plans for the whole mission: those
        of their own objectives, since they could not complete their rounds at the charger."""
        robots = self._state.robots.values()
        return {i: None for i, r in enumerate(robots) if r.assignment.role is Role.CHARGES}

    def stays(self, floor: Floor) -> dict[int, Mask]:
        """Return the poses in which a robot's formulas allow it to stay, for robots on shared
        floors with formulas that forbid it elsewhere. In other poses such a robot has no strategy,
        since others may keep it from leaving."""
        found = dict[int, Mask]()
        for index, robot in enumerate(self._state.robots.values()):
            formulas = formulas_of(robot.robot, self._state.scenario.map)
            if formulas is None or not robot.active or not self._state.rivals(robot.robot):
                continue
            if formulas.staying != formulas.graph.everywhere:
                found[index] = _lifted(floor, index, formulas.staying)
        return found

    def charged(self, problem: SearchProblem) -> SearchProblem:
        """Return the same problem, tracking the charge of each robot that has enough to continue
        alone."""
        start, batteries, charges = problem.start, dict[int, Stops](), list[int]()
        poses = formula_memory.plain_poses(problem.floor.problem, start.poses)
        for index, robot in enumerate(self._state.robots.values()):
            stops = self._state.stops(robot)
            if stops is None or robot.charge is None or not robot.active:
                continue
            charge = stops.charge_after(int(robot.charge), poses[index], moves=False)
            if charge >= stops.needed(poses[index], stops.turn(start.counts[index][0])):
                batteries[index] = stops
                charges.append(charge)
        course = replace(problem.course, batteries=batteries)
        return replace(problem, course=course, start=replace(start, charges=tuple(charges)))

    def has_charge(self, floor: Floor, states: Sequence[JointState]) -> bool:
        """Return whether on a plan each robot that has enough charge to continue alone keeps
        enough."""
        charged = self.charged(self.problem(floor, poses=states[0].poses))
        poses = (state.poses for state in states[1:])
        return all(map(charged.course.has_charge, charged.course.along(charged.start, poses)))

    def only_out(self, robots: Sequence[RobotState]) -> bool:
        """Return whether each of these robots is out of service or cut off by a robot that is."""
        active = {robot.name for robot in robots if robot.active}
        if not active or not self._state.out_of_service:
            return not active
        floor = self.floor()
        return active <= {floor.names[index] for index in self.cut_off(floor)}

    def course(self, floor: Floor) -> Course:
        """Return the rules of a plan from here: the rounds that it looks ahead, the served
        obstacles and their helpers, and the robots excused until one out of service returns."""
        served = frozenset(self._state.last_settled.found.served)
        sent = {
            index: floor.gates.index(robot.assignment.obstacle)
            for index, robot in enumerate(self._state.robots.values())
            if robot.assignment.role is Role.HELPS and robot.assignment.obstacle in floor.gates
        }
        return Course(
            floor.problem,
            self._rounds_ahead(),
            served=served,
            sent=sent,
            excused=self.cut_off(floor, every=True),
        )

    def _rounds_ahead(self) -> int:
        done = max(robot.own.rounds for robot in self._state.robots.values())
        return min(self._state.scenario.until.rounds, done + ROUNDS_AHEAD)

    def problem(
        self, floor: Floor, course: Course | None = None, poses: tuple[int, ...] | None = None
    ) -> SearchProblem:
        """Return the search problem from the present state, or from other poses."""
        course = course or self.course(floor)
        counts = self.counts(floor, course.rounds)
        return SearchProblem(
            floor, course, course.begun(poses or floor.poses, counts, floor.stages)
        )

    def counts(self, floor: Floor, rounds: int | None = None) -> tuple[Count, ...]:
        """Return the progress of each robot with its own objective, as joint states count it."""
        rounds, found = rounds or self._rounds_ahead(), []
        for robot, member in zip(self._state.robots.values(), floor.problem.members, strict=True):
            progress = robot.own
            turn = progress.memory.index if member.in_turn else 0
            if member.settles:
                found.append((turn, 0, int(progress.rounds >= rounds)))
            elif member.in_turn:
                met = progress.rounds * len(member.targets) + len(progress.seen)
                found.append((turn, 0, met))
            else:
                seen = region_mask(progress.seen) if len(member.targets) > 1 else 0
                found.append((0, seen, progress.rounds))
        return tuple(found)

    def search(self, problem: SearchProblem, goal: Goal | None = None, *, work: Effort) -> Search:
        """Return a search for a plan. ``goal``: where the plan may end (None: once the mission is
        completed); ``work``: the effort that it may take."""

        def guide(stages: Stages, poses: tuple[int, ...]) -> list[Mask | None]:
            found = self._guide(problem.floor, stages, poses)
            for robot, aim in problem.goals.items() if stages == problem.start.stages else ():
                found[robot] = aim
            return found

        return Search(
            problem.course,
            guide,
            problem.start,
            goal or problem.course.completed,
            seed=self._state.scenario.seed + self._state.tick,
            stopping=self._stop.check,
            work=work,
        )

    def _guide(self, floor: Floor, stages: Stages, poses: tuple[int, ...]) -> list[Mask | None]:
        """Return the goal poses that coordination would give each robot at a stage."""
        if stages == floor.stages:
            cut_off = self.cut_off(floor)
            return [self._goal_poses(floor, name, cut_off) for name in floor.names]
        requests = floor.problem.open(stages)
        try:
            plain = formula_memory.plain_poses(floor.problem, poses)
            found = settle(self._state.last_settled.solver, plain, stages, requests, {})
        except BudgetExhaustedError:
            return [None] * len(poses)
        goals = {index: _lifted(floor, index, duty.goal) for index, duty in found.duties.items()}
        return [goals.get(index) for index in range(len(poses))]


def _lifted(floor: Floor, index: int, poses: Mask) -> Mask:
    """Return poses of a robot in the numbering of a floor."""
    graph = floor.problem.members[index].graph
    return graph.lifted(poses) if isinstance(graph, formula_memory.StateGraph) else poses
