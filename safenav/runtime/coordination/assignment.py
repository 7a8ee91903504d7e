"""Objectives from duties: the assignment of each robot, and constraints on its strategy."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from msgspec import Struct
from msgspec.structs import replace

from safenav.runtime.coordination.task_candidates import TaskDraft
from safenav.runtime.coordination.waiting import clear_region, in_the_way
from safenav.runtime.duties.settlement import Duty, Settlement
from safenav.runtime.resolution.problem import Floor
from safenav.runtime.team import Assignment, RobotState, Role, TeamState
from safenav.scenario.guarantees import guarantees_of
from safenav.scenario.objective import (
    ALTERNATING,
    Ltl,
    Objective,
    Target,
    TargetObjective,
    alternation,
    formulas_in,
    ruled,
    station,
    staying,
)
from safenav.scenario.settings import Coordination
from safenav.spec.movement import one_of
from safenav.world.map import Region
from safenav.world.moves import Pose
from safenav.world.poses import Mask, bits, region_mask


def holding(objective: Objective, region: Region) -> Objective:
    """Return the objective of a waiting requester: stay in ``region``.

    The robot keeps its safety guarantees while it waits.
    """
    if isinstance(objective, Ltl):
        stay = f"region = {region} -> region' = {region}"
        return replace(
            objective, safety=(*objective.safety, stay), liveness=(f"region = {region}",)
        )
    return staying(frozenset({region}), objective)


def helping(objective: Objective, places: Target, own: Target | None, *, stays: bool) -> Objective:
    """Return the objective of a helper: go to ``places`` first, then alternate with its ``own``
    target, or wait there for other robots of the group.

    Plain alternation, not the literal Patrol formula, which would forbid a robot that leaves a
    doorway on the far side to come back through it.
    """
    if isinstance(objective, Ltl):
        there = one_of("region", places)
        stay = (f"{there} -> region' = region",) if stays else ()
        return replace(objective, safety=(*objective.safety, *stay), liveness=(there,))
    if stays:
        return staying(places, objective)
    return alternation((places,) if own is None else (places, own), objective)


class Assigner(Struct, frozen=True):
    """Assigns objectives to robots at one moment. ``idle``: robots without a strategy for their own
    objective; they wait while anything may still change."""

    state: TeamState
    floor: Floor
    found: Settlement
    idle: Collection[str] = ()

    def drafts(self) -> dict[str, TaskDraft]:
        """The new task of every robot; its present one if the settlement is a proof."""
        robots = self.state.robots
        if self.found.proof is not None:
            return {name: _as_before(robot) for name, robot in robots.items()}
        return {name: self._draft(robot) for name, robot in robots.items()}

    def _draft(self, robot: RobotState) -> TaskDraft:
        index = self.floor.index(robot.name)
        if not robot.active:  # it keeps its assignment unless it was helping
            if robot.assignment.role is Role.HELPS:
                return self._wait(robot, index)
            return _as_before(robot)
        stop = robot.stop  # if it is blocked, another stop follows after this turn
        if stop is not None and self._alternates(index, (self._stop(robot, index, stop),)):
            return self._charge(robot, index, stop)
        duty = self.found.duties.get(index)
        if duty is not None:
            first = self._own(robot, index) if self._meets_own_first(robot, index, duty) else None
            return self._help(robot, index, duty) if first is None else self._later(first, duty)
        if robot.name not in self.idle and index in self.found.early:
            return self._help(robot, index, self.found.early[index], Role.EARLY)
        if robot.name in self.idle or self._waits_for_help(robot):
            return self._wait(robot, index)
        return self._own(robot, index) or self._wait(robot, index)

    def is_stranded(self, name: str) -> bool:
        """Whether a robot without a reason to wait cannot pursue its own objective: the last
        decision did not expect it in this pose."""
        robot, index = self.state.robots[name], self.floor.index(name)
        busy = robot.stop is not None or index in {**self.found.duties, **self.found.early}
        if busy or not robot.active or self._waits_for_help(robot):
            return False
        return self._own(robot, index) is None

    def _charge(self, robot: RobotState, index: int, charger: Pose) -> TaskDraft:
        """Go to the charger and stay there, around the obstacles in its way; if it is there with
        another heading, come back to it."""
        own = robot.robot.objective
        objective = holding(own, charger.region)
        if robot.next_pose.region == charger.region and robot.next_pose != charger:
            objective = alternation((frozenset({charger.region}),), own)
        goal = self._mask(index, {charger.region})
        role = Role.OWN if objective == robot.own.objective else Role.CHARGES
        duty = self.found.duties.get(index)  # the duty after charging
        obstacle = None if duty is None else self.floor.problem.gates[duty.gate].name
        return self._toward(robot, index, (goal,), Assignment(role, objective, obstacle, goal))

    def _toward(
        self, robot: RobotState, index: int, targets: tuple[Mask, ...], assignment: Assignment
    ) -> TaskDraft:
        """The draft of an assignment with these targets, around the obstacles in its way."""
        safe = replace(assignment, safe_poses=self.found.safe_poses[index])
        pending, forbidden = self._pending(index), self._forbidden(robot, index, targets)
        return TaskDraft(safe, assignment.objective, pending, pending, forbidden)

    def _stop(self, robot: RobotState, index: int, stop: Pose) -> Mask:
        """Return the poses in which a robot meets a stop: with its heading, unless it may have to
        let other robots pass."""
        if stop.heading is None or self.state.rivals(robot.robot):
            return self._mask(index, {stop.region})
        return 1 << self.floor.problem.members[index].graph.number(stop)

    def _help(
        self, robot: RobotState, index: int, duty: Duty, role: Role = Role.HELPS
    ) -> TaskDraft:
        gate = self.floor.problem.gates[duty.gate]
        member = self.floor.problem.members[index]
        places = frozenset(bits(member.graph.regions_of(duty.goal)))
        direct = duty.stays or bool(duty.around)
        own = None if direct else self._own_target(robot, index, duty.goal)
        stays = duty.stays and self._may_stay_at(robot, map(member.graph.pose, bits(duty.goal)))
        objective = helping(robot.robot.objective, places, own, stays=stays)
        for before in () if direct else self._before(robot, gate.name):
            others = [self._mask(index, target) for target in before.targets[1:]]
            if before.targets[0] == places and self._alternates(index, (duty.goal, *others)):
                objective = ruled(before, robot.robot.objective)  # it keeps its former order
                break
        wanted = (duty.goal,) if own is None else (duty.goal, self._mask(index, own))
        served = gate.name if role is Role.HELPS else None
        assignment = Assignment(role, objective, served, duty.goal)
        draft = self._toward(robot, index, wanted, assignment)
        around = member.graph.poses_on(duty.around) & ~(1 << self.floor.poses[index])
        avoided = {member.graph.pose(number) for number in bits(around)}
        spots = self._spots(index, duty, wanted)
        return replace(draft, forbidden=draft.forbidden | avoided, places=spots)

    def _spots(self, index: int, duty: Duty, targets: tuple[Mask, ...]) -> frozenset[Pose]:
        """The only poses in which a robot enters the region of its duty; none if any suffices, or
        if it cannot reach its duty and its other target without the rest."""
        graph = self.floor.problem.members[index].graph
        others = graph.poses_on(graph.regions_of(duty.goal)) & ~duty.goal
        if not (duty.exact and others) or not self._alternates(index, targets, others):
            return frozenset()
        return frozenset(graph.pose(number) for number in bits(duty.goal))

    def _meets_own_first(self, robot: RobotState, index: int, duty: Duty) -> bool:
        """Whether a robot can and must meet the next target of its ``once`` before its duty, since
        afterwards it could not meet all remaining ones."""
        problem, stages = self.floor.problem, self.floor.stages
        member, coordination = problem.members[index], self.state.scenario.coordination
        if not (member.settles and member.turns) or coordination is Coordination.ASSIGNABLE:
            return False
        left, graph = member.targets[robot.own.memory.index :], member.graph
        before = problem.allowed(index, stages)
        after = problem.allowed(index, problem.advanced(duty.gate, stages, duty.group))
        rest, here = duty.goal, graph.closure(1 << self.floor.poses[index], before)
        for target in left:
            rest = graph.closure(rest, after) & target
        return not rest and bool(graph.closure(here & left[0], before) & duty.goal)

    def _later(self, draft: TaskDraft, duty: Duty) -> TaskDraft:
        """Return the draft of its own objective for a robot that serves an obstacle afterwards."""
        obstacle = self.floor.problem.gates[duty.gate].name
        return replace(draft, assignment=replace(draft.assignment, obstacle=obstacle))

    def _own_target(self, robot: RobotState, index: int, goal: Mask) -> Target | None:
        """Return its waiting place, or the first of its own targets, between which and the duty it
        can alternate; None if there is none."""
        waiting = [frozenset({place}) for place in self._waiting_places(robot)]
        for target in (*waiting, *robot.robot.objective.targets):
            if self._alternates(index, (goal, self._mask(index, target))):
                return target
        return None

    def _before(self, robot: RobotState, obstacle: str) -> list[TargetObjective]:
        """The objectives with which a robot has served an obstacle: the present one, and those
        pushed with the requests that are popped now, the last first."""
        popped = reversed(self.state.requests.closed)
        found = [(robot.assignment.obstacle, robot.assignment.objective)]
        found += [request.saved[robot.name] for request in popped if robot.name in request.saved]
        return [o for served, o in found if served == obstacle and isinstance(o, ALTERNATING)]

    def _alternates(self, index: int, targets: tuple[Mask, ...], shut: Mask = 0) -> bool:
        member = self.floor.problem.members[index]
        allowed = self.floor.problem.allowed(index, self.floor.stages) & ~shut
        allowed &= self.found.safe_poses[index]
        live = member.graph.live(targets, allowed)
        return bool(member.graph.closure(1 << self.floor.poses[index], allowed) & live)

    def _waits_for_help(self, robot: RobotState) -> bool:
        served = {self.floor.gates[gate] for gate in self.found.served}
        return any(
            request.obstacle.name in served for request in self.state.requests.waits(robot.name)
        )

    def _wait(self, robot: RobotState, index: int) -> TaskDraft:
        """Pursue the objective for waiting, if there is one; else hold where it encountered the
        obstacle or held before, or nearby if it would block a helper there; if it cannot get there
        now, hold where it stands."""
        here = robot.next_pose.region
        if robot.name not in self.idle and self._waits_for_help(robot):
            meanwhile = self.while_waiting(robot.name)
            if meanwhile is not None:
                return meanwhile
        there = self._waiting_place(robot, index)
        targets = (self._mask(index, {there}),)
        if there != here and self._alternates(index, targets):
            objective = holding(robot.robot.objective, there)
            return self._toward(robot, index, targets, Assignment(Role.WAITS, objective))
        if not self._may_stay_at(robot, [robot.next_pose]):  # it cannot stay: it leaves and returns
            objective = helping(robot.robot.objective, frozenset({here}), None, stays=False)
            targets = (self._mask(index, {here}),)
            return self._toward(robot, index, targets, Assignment(Role.WAITS, objective))
        objective, safe = holding(robot.robot.objective, here), self.found.safe_poses[index]
        return TaskDraft(Assignment(Role.WAITS, objective, safe_poses=safe), objective)

    def while_waiting(self, name: str) -> TaskDraft | None:
        """The task with a robot's objective for waiting; None if it has none, or cannot pursue
        it."""
        robot, index = self.state.robots[name], self.floor.index(name)
        other = robot.robot.while_waiting
        if other is None:
            return None
        if not isinstance(other, Ltl):
            other = ruled(other, robot.robot.objective)  # its rules may have changed
        targets = tuple(self._mask(index, target) for target in other.targets)
        if not self._alternates(index, targets):
            return None
        return self._toward(robot, index, targets, Assignment(Role.WAITS, other))

    def _may_stay_at(self, robot: RobotState, poses: Iterable[Pose]) -> bool:
        """Whether its formulas allow a robot to stay in each of these poses."""
        formulas = formulas_in(robot.robot.objective)
        guarantees = None if formulas is None else guarantees_of(formulas)
        return guarantees is None or all(guarantees.allows(pose, pose) for pose in poses)

    def _waiting_place(self, robot: RobotState, index: int) -> Region:
        """Return the region where a robot waits, whether or not it can get there."""
        place = next(iter(self._waiting_places(robot)), robot.next_pose.region)
        duties = self.found.duties
        if self._waits_for_help(robot) and in_the_way(self.floor, duties, index, place):
            rivals = self.floor.problem.conflicts[index]
            taken = {
                region
                for other, name in enumerate(self.floor.names)
                if other in rivals and self.state.robots[name].assignment.role is Role.WAITS
                for region in self.state.robots[name].occupied
            }
            clear = clear_region(self.floor, duties, index, self.found.safe_poses[index], taken)
            return place if clear is None else clear
        return place

    def _waiting_places(self, robot: RobotState) -> list[Region]:
        places = [r.requesters[robot.name] for r in reversed(self.state.requests.waits(robot.name))]
        before = robot.assignment
        if before.role is Role.WAITS:
            places += station(before.objective) or ()
        return places[:1]

    def _own(self, robot: RobotState, index: int) -> TaskDraft | None:
        """Return its own objective, around the obstacles in its way; None if it cannot pursue it
        now."""
        met = {request.obstacle.name for request in self.state.requests.waits(robot.name)}
        safe = self.found.safe_poses[index]
        objective = robot.robot.objective
        assignment = Assignment(Role.OWN, objective, safe_poses=safe)
        member = self.floor.problem.members[index]
        must = frozenset(met)
        within_reach = self.floor.reach(index)
        for avoid in (self._pending(index) | must, must):
            walls = region_mask(
                gate.region for gate in self.floor.problem.gates if gate.name in avoid
            )
            lost = within_reach & ~safe
            allowed = member.floor & ~member.graph.poses_on(walls) & ~lost
            reach = member.graph.closure(1 << self.floor.poses[index], allowed)
            if reach & member.live(allowed):
                forbidden = self._forbidden(robot, index, member.targets)
                return TaskDraft(assignment, objective, avoid, must, forbidden)
        if not self.found.served and isinstance(objective, Ltl):
            return TaskDraft(assignment, objective, must, must)
        return None

    def _pending(self, index: int) -> frozenset[str]:
        """The open obstacles that block a robot now."""
        problem, stages = self.floor.problem, self.floor.stages
        return frozenset(
            problem.gates[gate].name
            for gate in problem.open(stages)
            if index in problem.gates[gate].closed_to[stages[gate].need]
        )

    def _forbidden(
        self, robot: RobotState, index: int, targets: tuple[Mask, ...]
    ) -> frozenset[Pose]:
        """The poses next to the safe ones from which it could still meet ``targets``; a strategy
        avoids the others by itself."""
        member = self.floor.problem.members[index]
        graph, safe = member.graph, self.found.safe_poses[index]
        allowed = self.floor.problem.allowed(index, self.floor.stages)
        lost = graph.forward(safe) & allowed & ~safe
        if lost and not isinstance(robot.robot.objective, Ltl):
            own = targets == member.targets
            lost &= member.live(allowed) if own else graph.live(targets, allowed)
        return frozenset(graph.pose(number) for number in bits(lost))

    def _mask(self, index: int, regions: Collection[int]) -> Mask:
        return self.floor.problem.members[index].graph.poses_on(region_mask(regions))


def _as_before(robot: RobotState) -> TaskDraft:
    return TaskDraft(robot.assignment, robot.assignment.objective)
